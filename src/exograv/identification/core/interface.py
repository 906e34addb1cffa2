"""What every identification method is: a stream of samples in; parameters, their uncertainty and a sentence out."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.sentence import Sentence, member_sentence

Joints = Float[np.ndarray, " joint"]
Parameters = Float[np.ndarray, " parameter"]
Covariance = Float[np.ndarray, "parameter parameter"]


@dataclass(slots=True)
class RequestedMotion:
    """The motion that was asked for, through the same filter as what was measured."""

    q: Joints
    """[rad]"""

    v: Joints
    """[rad/s]"""

    a: Joints
    """[rad/s²]"""


@dataclass(slots=True)
class Sample:
    """One moment of the motion, every quantity through the same filter."""

    t: float
    """Seconds of motion since the first sample [s]."""

    q: Joints
    """[rad]"""

    v: Joints
    """[rad/s]"""

    a: Joints
    """[rad/s²]"""

    tau: Joints
    """Measured torque of the joints [N·m]."""

    asked: RequestedMotion | None = None
    """None where nobody asked for a motion, or nobody knows for which."""


class Outcome(enum.Enum):
    """How an identification ended; the value is a sentence for the operator."""

    RUNNING = "The identification is still running."
    CONVERGED = "The arm is identified: the predicted left over is within its target."
    EXHAUSTED = "More of this motion would tell little more: the next 10 s improve the prediction by less than 5 %."
    TIME_IS_UP = "The motion ended before the target was reached. Run a longer one."
    NOT_EXCITED = "The joints moved too little to tell the arm's weight. Run the longer motion."
    NOT_RELAXED = "The person did not relax. Ask the person to let go, then repeat."
    TABLE_ONLY = "Nothing was measured: the arm is the one of the anthropometric table."
    NO_INTERVAL = (
        "The motion is over. This method states no uncertainty, so nothing says whether the arm is identified."
    )

    @property
    def sentence(self) -> Sentence:
        """Its value, with the code under which other languages have it."""
        return member_sentence("outcome", self)


@dataclass(frozen=True)
class Estimate:
    """What is known after some motion."""

    t: float
    """Seconds of motion used [s]."""

    x: Parameters
    """Parameters in the model's order, physically possible."""

    covariance: Covariance | None
    """Of `x`; None where the method states none."""

    rejected_share: float
    """Share of the samples that were given less than half their weight [-]."""

    noise_scale: float
    """How restless the wearer was, against the assumed size [-]; 1 where the method does not ask."""

    @property
    def sd(self) -> Parameters:
        """One standard deviation of each parameter; NaN where the method states none."""
        if self.covariance is None:
            return np.full_like(self.x, np.nan)
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


@runtime_checkable
class TorqueModel(Protocol):
    """Expected torque of a motion, and how it depends on the parameters."""

    n_joints: int
    n_parameters: int

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Expected torque (joint,) [N·m] at `x`, and its derivative with respect to `x`."""
        ...

    def restart(self) -> None:
        """The next sample does not follow the one before."""
        ...

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Standard deviation of the torque [N·m] for want of a known direction of motion, at velocity `v` [rad/s]."""
        ...


@runtime_checkable
class Method(Protocol):
    """An identification method."""

    name: str

    def update(self, sample: Sample) -> None:
        """Take one sample, in the order of time, at the loop's rate."""
        ...

    def estimate(self) -> Estimate:
        """What is known now."""
        ...


@dataclass(frozen=True)
class Rest:
    """A posture in which the relaxed arm was held still, and what was measured there, averaged."""

    q: Joints
    """[rad]"""

    tau: Joints
    """Torque of the motors by their current, friction included [N·m]."""

    wrenches: Float[np.ndarray, "cuff 6"]
    """Force [N] and moment [N·m] of each cuff on the arm, as `rig.interface.CuffSensing`."""

    seconds: float
    """What it took, the way there included [s]."""


@runtime_checkable
class RestingMethod(Method, Protocol):
    """A method that learns from resting postures before any motion; `update` only moves its clock."""

    rests_needed: int

    rest_s: float
    """Seconds that its rests took; a comparison adds them to the time of motion."""

    @property
    def postures(self) -> Float[np.ndarray, "rest joint"]:
        """Where the arm should rest, in this order [rad]."""
        ...

    def take_rests(self, rests: Sequence[Rest]) -> None:
        """Learn from as many rests as are needed."""
        ...
