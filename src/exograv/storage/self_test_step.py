"""One line of the self-test: what was looked at, what it was, what it may be, and what to do where it is not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ExogravError


@dataclass(frozen=True)
class Step:
    """A line of the result."""

    name: str
    passed: bool | None
    """None where it was not tried, because something before it failed."""

    measured: float | str | None = None
    limit: float | str | None = None
    unit: str = ""
    what_to_do: str = ""
    """Empty where it passed without a warning."""

    locks_only: bool = False
    """Whether it says nothing of the machine, only that nobody may be in it with this computer."""


def within(name: str, measured: float, limit: float, unit: str, what_to_do: str) -> Step:
    """A figure that must not be larger than its limit; one that is no number is too large."""
    passed = bool(abs(measured) <= limit)
    shown = round(float(measured), 4) + 0.0 if np.isfinite(measured) else str(measured)  # 0 has no sign
    return Step(name, passed, shown, limit, unit, "" if passed else what_to_do)


def worst(values: Float[np.ndarray, " joint"], joints: Sequence[str]) -> tuple[float, str]:
    """The largest by size, and its joint."""
    size = np.where(np.isfinite(values), np.abs(values), np.inf)
    joint = int(size.argmax())
    return float(values[joint]), joints[joint]


def tried(name: str, act: Callable[[], list[Step]]) -> list[Step]:
    """Steps by an action; one that raises is a step that failed, and the error says what to do."""
    try:
        return act()
    except ExogravError as error:
        return [Step(name, False, what_to_do=str(error))]
