"""Kinds of tasks for a sweep. A new kind is a file beside these and a line here."""

from collections.abc import Mapping
from types import MappingProxyType

from .identify_task import IDENTIFY
from .participants_task import PARTICIPANTS
from .probe_task import PROBE
from .table_task import TABLE
from .task import TaskKind
from .transparency_task import TRANSPARENCY

KINDS: Mapping[str, TaskKind] = MappingProxyType(
    {kind.name: kind for kind in (IDENTIFY, TABLE, TRANSPARENCY, PARTICIPANTS, PROBE)}
)
"""Kinds by the word after `kind =`."""
