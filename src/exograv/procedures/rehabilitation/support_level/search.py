"""Adaptive search of the needed support: choice of target and support of each attempt until the interval is narrow."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv.loop.pilot import Progress
from exograv.task.levels import slewing_s

from .targets import TARGETS
from .threshold import DRAWS_LAST, Posterior, ThresholdSearch

CRITERION = 0.8
"""Share of the targets that must be reached [-]: ten of twelve are more, nine are fewer."""

SUPPORTS = np.linspace(0.0, 1.0, 41)
STEP_DOWN_MAX = 0.15
"""Largest step of support below the smallest successful support [share of the weight]. For a heavy arm 1.6 N·m are then
missing, and a failing arm sinks slowly.
"""

WIDTH_ENOUGH = 0.08
"""Width of the 95 % interval at which the search ends [share of the weight]."""

ATTEMPTS_MIN, ATTEMPTS_MAX = 16, 80
ASK_EVERY = 4
ATTEMPT_S = 6.0
"""Approximate duration of an attempt, there and back [s]."""


Tries = Callable[[int, float], bool]
"""Callback that makes one attempt at a target with a support [share of the weight]. It returns True if the person
reached the target."""


@dataclass(frozen=True)
class NeededSupport:
    """Result of the search: the support that the person needs, with its interval."""

    posterior: Posterior
    attempts: int

    @property
    def ci(self) -> tuple[float, float, float]:
        """Median and 95 % interval, limited to 0 and 1 [share of the weight]."""
        middle, low, high = (min(max(value, 0.0), 1.0) for value in self.posterior.interval())
        return middle, low, high

    @property
    def beyond(self) -> float:
        """Probability that full support of the arm is not enough [-]."""
        return float((self.posterior.needed > 1.0).mean())


def search(tries: Tries, seed: int, progress: Progress, width: float = WIDTH_ENOUGH) -> NeededSupport:
    """Make attempts from full support downwards, and then where they are most informative.

    Args:
        tries: Function that makes one attempt.
        seed: Seed of the draws by which attempts are chosen.
        progress: Called after every attempt.
        width: Width of the 95 % interval at which the search ends.
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
        # The support goes up and down from attempt to attempt, so one phase has them all.
        progress(f"Searching the needed support, at most {ATTEMPTS_MAX} attempts", attempts / ATTEMPTS_MAX)
        if attempts >= ATTEMPTS_MIN and attempts % ASK_EVERY == 0 and _width(found.posterior()) <= width:
            break
    return NeededSupport(found.posterior(DRAWS_LAST), attempts)


def _width(posterior: Posterior) -> float:
    _, low, high = posterior.interval()
    return min(high, 1.02) - max(low, -0.02)
