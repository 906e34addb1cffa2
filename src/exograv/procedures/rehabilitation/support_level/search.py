"""The search itself: which target with how much support next, until the answer is narrow enough."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv.loop.pilot import Progress
from exograv.task.levels import slewing_s

from .targets import TARGETS
from .threshold import DRAWS_LAST, Posterior, ThresholdSearch

CRITERION = 0.8
"""Share of the targets that is to be reached [-]: ten of twelve are more, nine are fewer."""

SUPPORTS = np.linspace(0.0, 1.0, 41)
STEP_DOWN_MAX = 0.15
"""Of support below the least with which anything was reached [share of the weight]: what then is missing to hold a
heavy arm is 1.6 N·m, and a failing arm sinks slowly."""

WIDTH_ENOUGH = 0.08
"""Of the 95 % interval [share of the weight]."""

ATTEMPTS_MIN, ATTEMPTS_MAX = 16, 80
ASK_EVERY = 4
ATTEMPT_S = 6.0
"""About, there and back."""


Tries = Callable[[int, float], bool]
"""Asks somebody for one attempt at a target with a support [share of the weight]; whether it was reached."""


@dataclass(frozen=True)
class NeededSupport:
    """The answer."""

    posterior: Posterior
    attempts: int

    @property
    def ci(self) -> tuple[float, float, float]:
        """Median and 95 % interval, within what a machine can carry [share of the weight]."""
        middle, low, high = (min(max(value, 0.0), 1.0) for value in self.posterior.interval())
        return middle, low, high

    @property
    def beyond(self) -> float:
        """Probability that carrying the whole arm is not enough [-]."""
        return float((self.posterior.needed > 1.0).mean())


def search(tries: Tries, seed: int, progress: Progress, width: float = WIDTH_ENOUGH) -> NeededSupport:
    """Ask for attempts from full support down, and further where they tell most.

    Args:
        tries: Makes one attempt.
        seed: Of the draws with which attempts are chosen.
        progress: Told after every attempt.
        width: Of the 95 % interval at which it ends.
    """
    found = ThresholdSearch(len(TARGETS), CRITERION, seed)
    at, least, attempts = 1.0, 1.0, 0
    while attempts < ATTEMPTS_MAX:
        allowed = SUPPORTS[least - STEP_DOWN_MAX - 1e-9 <= SUPPORTS]
        seconds = ATTEMPT_S + np.array([slewing_s(at, support) for support in allowed])
        target, at = found.most_telling(allowed, seconds)
        reached = tries(target, at)
        found.take(target, at, reached)
        least, attempts = min(least, at) if reached else least, attempts + 1
        progress(f"Reaching with {100 * at:.0f} % of the weight carried", attempts / ATTEMPTS_MAX)
        if attempts >= ATTEMPTS_MIN and attempts % ASK_EVERY == 0 and _width(found.posterior()) <= width:
            break
    return NeededSupport(found.posterior(DRAWS_LAST), attempts)


def _width(posterior: Posterior) -> float:
    _, low, high = posterior.interval()
    return min(high, 1.02) - max(low, -0.02)
