"""Form of a wearer: body data, and the lengths to which the machine is set."""

from collections.abc import Mapping
from dataclasses import dataclass

from .anthropometry import Body


@dataclass(frozen=True)
class WearerForm:
    """Body data of the person and settings of the machine."""

    body: Body
    lengths: Mapping[str, float]
    """Lengths to which the machine is set, by segment [m]."""
