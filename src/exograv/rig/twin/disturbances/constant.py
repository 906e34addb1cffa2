"""Constants of models of people, each with value, unit, source, and range of uncertainty."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal

Standing = Literal["source", "unverified", "assumed", "fitted"]
"""Origin of a value: read in a source; reported to be in a source; chosen; fitted to a published figure."""


@dataclass(frozen=True)
class Constant:
    """Constant of a model of people, as one row of the table of constants."""

    name: str
    value: float
    unit: str
    standing: Standing
    source: str
    """Source of the value, or reason for the choice."""

    low: float
    """Lower end of the value's plausible range; `high` is the upper end. Sweeps compute results over this range."""

    high: float


def constant(value: float, unit: str, standing: Standing, source: str, low: float, high: float) -> Any:
    """Field of a frozen dataclass that is part of the register."""
    return field(default=value, metadata={"unit": unit, "standing": standing, "source": source, "swept": (low, high)})


def constants_of(settings: Any) -> Iterator[Constant]:
    """Yield the rows of a dataclass and of all dataclasses in it, with their present values."""
    for one in fields(settings):
        value, known = getattr(settings, one.name), one.metadata
        if "standing" in known:
            low, high = known["swept"]
            yield Constant(one.name, value, known["unit"], known["standing"], known["source"], low, high)
        elif is_dataclass(value):
            yield from constants_of(value)
