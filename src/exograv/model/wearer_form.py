"""The form of a wearer: body data, and the lengths to which the machine is set."""

from collections.abc import Mapping
from dataclasses import dataclass

from .anthropometry import Body


@dataclass(frozen=True)
class WearerForm:
    """What is told of the person and of the machine's settings."""

    body: Body
    lengths: Mapping[str, float]
    """What the machine is set to, by segment [m]."""
