"""Ornstein–Uhlenbeck process about zero, one per entry, exact at the ticks, drawn in blocks."""

import numpy as np
from jaxtyping import Float

BLOCK = 256
"""Number of ticks that are drawn at once. A longer block would take a large part of a tick, when drives are simulated
in real time."""

PerEntry = Float[np.ndarray, " entry"]


class OrnsteinUhlenbeck:
    """Ornstein–Uhlenbeck process that starts in its stationary distribution."""

    def __init__(self, sd: PerEntry, lasts_s: PerEntry | float, period_s: float, random: np.random.Generator):
        """Set standard deviation and correlation time [s] of each entry, and draw the first values."""
        self._sd, self._random = sd, random
        self._decay = np.broadcast_to(np.exp(-period_s / np.asarray(lasts_s)), sd.shape)
        self._value = sd * random.standard_normal(len(sd))

    def block(self) -> Float[np.ndarray, "tick entry"]:
        """Return the next `BLOCK` ticks."""
        rows = np.empty((BLOCK, len(self._sd)))
        kicks = self._random.standard_normal(rows.shape) * self._sd * np.sqrt(1.0 - self._decay**2)
        each = zip(self._value.tolist(), self._decay.tolist(), kicks.T.tolist(), strict=True)
        # In plain Python: the import of a filter from SciPy takes longer than all blocks of a run.
        for entry, (value, decay, of_entry) in enumerate(each):
            column = list[float]()
            for kick in of_entry:
                value = kick + decay * value
                column.append(value)
            rows[:, entry] = column
        self._value = rows[-1].copy()
        return rows
