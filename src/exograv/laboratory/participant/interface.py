"""Interface of a participant at the screen: perception, and muscle torque."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.task.picture import ParticipantPicture

PerFreedom = Float[np.ndarray, " arm"]


@runtime_checkable
class Participant(Protocol):
    """Participant who perceives screen and touches, and returns muscle torque. Other models can replace it."""

    def see(self, t: float, picture: ParticipantPicture) -> None:
        """See the participant's page at time `t` [s]: countdown, arrow, half of the target."""
        ...

    def touched(self, t: float, off: Float[np.ndarray, " 2"] | None) -> None:
        """Notice that the finger has met the screen, with the seen deviation from the target, right and up [m].

        `off` is None if the deviation cannot be seen.
        """
        ...

    def act(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] with the own arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        ...
