"""A constant of a model of people: its value stands with its unit, where it comes from, and how far it may be off."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal

Standing = Literal["source", "unverified", "assumed", "fitted"]
"""Read in a source; said to stand in one; chosen; chosen so that a published figure is met."""


@dataclass(frozen=True)
class Constant:
    """One row of the register."""

    name: str
    value: float
    unit: str
    standing: Standing
    source: str
    """Of the value, or why it was chosen."""

    low: float
    """Least and greatest value over which results are swept."""

    high: float


def constant(value: float, unit: str, standing: Standing, source: str, low: float, high: float) -> Any:
    """A field of a frozen dataclass that stands in the register."""
    return field(default=value, metadata={"unit": unit, "standing": standing, "source": source, "swept": (low, high)})


def constants_of(settings: Any) -> Iterator[Constant]:
    """Rows of a dataclass and of all dataclasses in it, with the values that they have there."""
    for one in fields(settings):
        value, known = getattr(settings, one.name), one.metadata
        if "standing" in known:
            low, high = known["swept"]
            yield Constant(one.name, value, known["unit"], known["standing"], known["source"], low, high)
        elif is_dataclass(value):
            yield from constants_of(value)
