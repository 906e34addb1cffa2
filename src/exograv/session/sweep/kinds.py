"""Every kind of task that a sweep can be made of; a new one is a file beside these and a line here."""

from collections.abc import Mapping
from types import MappingProxyType

from .of_identify import IDENTIFY
from .of_participants import PARTICIPANTS
from .of_probe import PROBE
from .of_table import TABLE
from .of_transparency import TRANSPARENCY
from .task import TaskKind

KINDS: Mapping[str, TaskKind] = MappingProxyType(
    {kind.name: kind for kind in (IDENTIFY, TABLE, TRANSPARENCY, PARTICIPANTS, PROBE)}
)
"""By the word after `kind =`."""
