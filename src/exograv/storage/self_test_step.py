"""Step of the self-test: measured value, limit, and advice if the value is beyond the limit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ExogravError


@dataclass(frozen=True)
class Step:
    """Result of one step."""

    name: str
    passed: bool | None
    """True if the step passed; None if it was not tried because an earlier step failed."""

    measured: float | str | None = None
    limit: float | str | None = None
    unit: str = ""
    what_to_do: str = ""
    """Advice for the operator; empty if the step passed without a warning."""

    locks_only: bool = False
    """True if a failure concerns only this computer: the machine may be in order, but nobody may wear it."""


def within(name: str, measured: float, limit: float, unit: str, what_to_do: str) -> Step:
    """Return a step for a figure that must not exceed its limit; a non-finite figure exceeds it."""
    passed = bool(abs(measured) <= limit)
    shown = round(float(measured), 4) + 0.0 if np.isfinite(measured) else str(measured)  # 0 has no sign
    return Step(name, passed, shown, limit, unit, "" if passed else what_to_do)


def worst(values: Float[np.ndarray, " joint"], joints: Sequence[str]) -> tuple[float, str]:
    """Return the entry of largest size, and its joint."""
    size = np.where(np.isfinite(values), np.abs(values), np.inf)
    joint = int(size.argmax())
    return float(values[joint]), joints[joint]


def tried(name: str, act: Callable[[], list[Step]]) -> list[Step]:
    """Return the steps of an action; an action that raises gives a failed step with the error as advice."""
    try:
        return act()
    except ExogravError as error:
        return [Step(name, False, what_to_do=str(error))]
