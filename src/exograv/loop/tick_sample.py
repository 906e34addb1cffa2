"""Sample of one tick for the listeners of a run."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.signals import JointState, Reference

Joints = Float[np.ndarray, " joint"]


class TickSample(NamedTuple):
    """Sample of one tick for listeners. The next tick overwrites the arrays."""

    state: JointState
    q: Joints
    """Observed position [rad]."""
    v: Joints
    """Observed velocity [rad/s]."""
    tau_measured: Joints
    """Measured torque: motor current times torque gain [N·m]."""
    tau_commanded: Joints
    """Torque that was sent to the motors [N·m]."""
    tau_feedforward: Joints
    """Torque that the model expects [N·m]."""
    reference: Reference
    """Reference of the controller."""


@runtime_checkable
class ObservedMotion(Protocol):
    """Part of a sample that a live run has, too."""

    @property
    def q(self) -> Joints:
        """Joint position at this tick, as control observes it [rad]."""
        ...

    @property
    def v(self) -> Joints:
        """Joint velocity at this tick, as control observes it [rad/s]."""
        ...
