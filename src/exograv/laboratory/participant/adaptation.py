"""Adaptation of a person to a weight of the own arm: one fast state, and slow states per context.

Two rates after Smith, Ghazizadeh and Shadmehr (2006), PLoS Biology 4:e179. Each context has its own slow state, because
wash-out alone does not explain savings (docs/howto/simulate_study.md). The context is inferred from the felt torque.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.constant import constant

SMITH = "Smith, Ghazizadeh & Shadmehr (2006), PLoS Biology 4:e179; other code has 0.92, 0.06, 0.995, 0.02"


@dataclass(frozen=True)
class AdaptationRates:
    """Rates of learning and retention per touch."""

    fast_keeps: float = constant(0.59, "-", "unverified", SMITH, 0.4, 0.92)
    fast_learns: float = constant(0.21, "-", "unverified", SMITH, 0.06, 0.3)
    slow_keeps: float = constant(0.992, "-", "unverified", SMITH, 0.98, 0.998)
    slow_learns: float = constant(0.02, "-", "unverified", SMITH, 0.01, 0.04)
    """Share of an error that the slow state learns from one touch [-]."""

    night_keeps: float = constant(0.9, "-", "assumed", "most is kept overnight", 0.7, 1.0)
    """Share of a slow state that remains from one session to the next."""

    width: float = constant(0.3, "-", "assumed", "of the inference of contexts; nothing published was found", 0.1, 1.0)
    """Difference of felt gravity levels at which learning still transfers, the width of a context.

        An adaptation at one level transfers to another one with the share exp(−(difference / 2 width)²).
    """

    felt_sd: float = constant(0.05, "-", "assumed", "a twentieth of the own weight is felt", 0.02, 0.15)
    """Standard deviation of the gravity level that is felt in a window."""


CONTEXTS = tuple(k / 8.0 for k in range(17))
"""Felt gravity levels with one slow state each, from zero to twice Earth's [-]."""


class Adaptation:
    """Expectation of gravity of one person."""

    def __init__(self, rates: AdaptationRates, random: np.random.Generator):
        """Start with experience of Earth's gravity only."""
        self._rates, self._random = rates, random
        self._fast = 0.0
        self._slow = np.zeros(len(CONTEXTS))
        self._recalled = self._weights(1.0)
        self.felt = 1.0
        """Gravity level that was felt last [-]."""

    @property
    def slow(self) -> tuple[float, ...]:
        """Slow states by context, which are kept from session to session."""
        return tuple(self._slow.tolist())

    def remember(self, slow: Sequence[float]) -> None:
        """Restore slow states from `slow`. States of another set of contexts are ignored."""
        if len(slow) == len(CONTEXTS):
            self._slow = np.array(slow, dtype=float)

    def window(self, gravity_level: float) -> None:
        """Start a window at this gravity level. The fast state is lost."""
        self._fast = 0.0
        self.felt = gravity_level + self._rates.felt_sd * float(self._random.standard_normal())
        self._recalled = self._weights(self.felt)

    def night(self) -> None:
        """Apply the loss until the next session."""
        self._fast = 0.0
        self._slow *= self._rates.night_keeps

    @property
    def expected(self) -> float:
        """Share of the arm's weight for which the muscles are prepared [-]."""
        return 1.0 - self._fast - float(self._recalled @ self._slow)

    def learn(self, error: float) -> None:
        """Learn from an error: expected minus true share of the weight [-]."""
        rates, recalled = self._rates, self._recalled
        self._fast = rates.fast_keeps * self._fast + rates.fast_learns * error
        known = float(recalled @ self._slow)
        self._slow += recalled * ((rates.slow_keeps - 1.0) * known + rates.slow_learns * error)

    def _weights(self, felt: float) -> Float[np.ndarray, " context"]:
        """Return weights of unit length. The width changes which contexts learn, but not the rate at one level."""
        off = ((np.array(CONTEXTS) - felt) / self._rates.width) ** 2
        likely = np.exp(-0.5 * (off - off.min()))
        return likely / np.linalg.norm(likely)
