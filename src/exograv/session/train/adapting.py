"""How a person gets used to a weight of the own arm: a fast state, and slow ones that belong to what is felt.

Two rates after Smith, Ghazizadeh and Shadmehr (2006), PLoS Biology 4:e179, one slow state a context, because wash-out
alone does not explain savings (docs/study.md); which context it is, is inferred from the torque that is felt.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Rates:
    """What a touch changes, and what stays; none of these is verified against its source."""

    fast_keeps: float = 0.59
    fast_learns: float = 0.21
    slow_keeps: float = 0.992
    slow_learns: float = 0.02
    """A touch's share."""

    night_keeps: float = 0.9
    """Of a slow state from one session to the next; assumed."""

    width: float = 0.3
    """By how much felt gravity levels may differ and still be the same context [-]; assumed."""

    felt_sd: float = 0.05
    """Of the gravity level that is felt in a window [-]; assumed."""


CONTEXTS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75)
"""Felt gravity levels that have a slow state each [-]."""


class Adaptation:
    """What one person expects of gravity."""

    def __init__(self, rates: Rates, random: np.random.Generator):
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
        rates = self._rates
        self._fast = rates.fast_keeps * self._fast + rates.fast_learns * error
        self._slow += self._recalled * ((rates.slow_keeps - 1.0) * self._slow + rates.slow_learns * error)

    def _weights(self, felt: float) -> Float[np.ndarray, " context"]:
        likely = np.exp(-0.5 * ((np.array(CONTEXTS) - felt) / self._rates.width) ** 2)
        return likely / likely.sum()
