"""Source of the wearer's muscle signals (EMG) during a motion in lock-step."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float


@runtime_checkable
class MuscleSource(Protocol):
    """Envelopes of the wearer's EMG, tick by tick."""

    @property
    def channels(self) -> int:
        """Number of signals that `now` returns [-]."""
        ...

    def now(self) -> Float[np.ndarray, " channel"]:
        """Return the signals of the present tick, as in `Sample.muscles` [-]."""
        ...
