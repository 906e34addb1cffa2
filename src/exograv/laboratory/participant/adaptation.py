"""How a person gets used to a weight of the own arm: a fast state, and slow ones that belong to what is felt.

Two rates after Smith, Ghazizadeh and Shadmehr (2006), PLoS Biology 4:e179, one slow state a context, because wash-out
alone does not explain savings (docs/howto/study.md); which context it is, is inferred from the torque that is felt.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.constant import constant

SMITH = "Smith, Ghazizadeh & Shadmehr (2006), PLoS Biology 4:e179; other code has 0.92, 0.06, 0.995, 0.02"


@dataclass(frozen=True)
class AdaptationRates:
    """What a touch changes, and what stays."""

    fast_keeps: float = constant(0.59, "-", "unverified", SMITH, 0.4, 0.92)
    fast_learns: float = constant(0.21, "-", "unverified", SMITH, 0.06, 0.3)
    slow_keeps: float = constant(0.992, "-", "unverified", SMITH, 0.98, 0.998)
    slow_learns: float = constant(0.02, "-", "unverified", SMITH, 0.01, 0.04)
    """A touch's share."""

    night_keeps: float = constant(0.9, "-", "assumed", "most is kept overnight", 0.7, 1.0)
    """Of a slow state from one session to the next."""

    width: float = constant(0.3, "-", "assumed", "of the inference of contexts; nothing published was found", 0.1, 1.0)
    """By how much felt gravity levels may differ and still be nearly the same context: what was learned at one level
    is worth exp(−(difference / 2 width)²) of it at another."""

    felt_sd: float = constant(0.05, "-", "assumed", "a twentieth of the own weight is felt", 0.02, 0.15)
    """Of the gravity level that is felt in a window."""


CONTEXTS = tuple(k / 8.0 for k in range(17))
"""Felt gravity levels that have a slow state each, from none to twice Earth's [-]."""


class Adaptation:
    """What one person expects of gravity."""

    def __init__(self, rates: AdaptationRates, random: np.random.Generator):
        """Nothing is known but Earth."""
        self._rates, self._random = rates, random
        self._fast = 0.0
        self._slow = np.zeros(len(CONTEXTS))
        self._recalled = self._weights(1.0)
        self.felt = 1.0
        """Gravity level as it was felt at last [-]."""

    @property
    def slow(self) -> tuple[float, ...]:
        """What is kept from session to session, by context."""
        return tuple(self._slow.tolist())

    def remember(self, slow: Sequence[float]) -> None:
        """What was learned before, as `slow` told it; of another set of contexts nothing is."""
        if len(slow) == len(CONTEXTS):
            self._slow = np.array(slow, dtype=float)

    def window(self, gravity_level: float) -> None:
        """The arm feels this level from now on; what was quick is gone."""
        self._fast = 0.0
        self.felt = gravity_level + self._rates.felt_sd * float(self._random.standard_normal())
        self._recalled = self._weights(self.felt)

    def night(self) -> None:
        """Until the next session."""
        self._fast = 0.0
        self._slow *= self._rates.night_keeps

    @property
    def expected(self) -> float:
        """Share of the arm's weight that muscles are prepared for [-]."""
        return 1.0 - self._fast - float(self._recalled @ self._slow)

    def learn(self, error: float) -> None:
        """More was expected than there was, by so much [-]."""
        rates, recalled = self._rates, self._recalled
        self._fast = rates.fast_keeps * self._fast + rates.fast_learns * error
        known = float(recalled @ self._slow)
        self._slow += recalled * ((rates.slow_keeps - 1.0) * known + rates.slow_learns * error)

    def _weights(self, felt: float) -> Float[np.ndarray, " context"]:
        """Of unit length: how wide the inference is changes where learning goes, never how fast it is at one level."""
        off = ((np.array(CONTEXTS) - felt) / self._rates.width) ** 2
        likely = np.exp(-0.5 * (off - off.min()))
        return likely / np.linalg.norm(likely)
