"""Who sits before the screen: what a participant sees and feels, and what comes of it."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.task.picture import ParticipantPicture

PerFreedom = Float[np.ndarray, " arm"]


@runtime_checkable
class Participant(Protocol):
    """Told what a person in that place would notice, asked for muscle torque; another model takes its place."""

    def see(self, t: float, picture: ParticipantPicture) -> None:
        """What the participant's page shows at time `t` [s]: countdown, arrow, half of the target."""
        ...

    def touched(self, t: float, off: Float[np.ndarray, " 2"] | None) -> None:
        """The finger has met the screen; the half-visible target lets it be seen how far off, right and up [m].

        None where it lets nothing be seen.
        """
        ...

    def act(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] with the own arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        ...
