"""Interface of all identification methods: samples in; parameters, uncertainty and outcome out."""

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

RESTLESS = 2.0
"""Slow torque over its usual size [-]; a wearer above it does not relax."""


@dataclass(slots=True)
class RequestedMotion:
    """Requested motion, through the same filter as the measurements."""

    q: Joints
    """Requested joint position [rad]."""

    v: Joints
    """Requested joint velocity [rad/s]."""

    a: Joints
    """Requested joint acceleration [rad/s²]."""


@dataclass(slots=True)
class Sample:
    """Sample of the motion; all quantities passed the same filter."""

    t: float
    """Time of motion since the first sample [s]."""

    q: Joints
    """Filtered joint position [rad]."""

    v: Joints
    """Filtered joint velocity [rad/s]."""

    a: Joints
    """Filtered joint acceleration [rad/s²]."""

    tau: Joints
    """Measured torque of the joints [N·m]."""

    asked: RequestedMotion | None = None
    """Requested motion; None if none was requested or it is not known."""

    muscles: Float[np.ndarray, " channel"] | None = None
    """Size of the muscles' signals (EMG) above rest, as a share of a maximum voluntary contraction [-]; None if they
    are not measured."""

    muscles_slow: Float[np.ndarray, " channel"] | None = None
    """Slow part of these signals [-]; None if it is not known."""


class Outcome(enum.Enum):
    """Outcome of an identification; the value is a sentence for the operator."""

    RUNNING = "The identification is still running."
    CONVERGED = "Estimate converged: the predicted left over is within its target, and unused postures agree."
    UNCHECKED = "The predicted left over is within its target. No check at unused postures has confirmed it."
    DISAGREES = "The torque at unused postures disagrees with the estimate, so the estimate has not converged."
    EXHAUSTED = (
        "More of this motion would add little: the next 10 s improve the prediction by less than 5 %. "
        "Design another motion with 'exograv rig motion'."
    )
    TIME_IS_UP = "The motion ended before the target was reached. Run a longer one."
    NOT_EXCITED = "The joints moved too little to determine the arm's weight. Run the longer motion."
    NOT_RELAXED = "The person did not relax. Ask the person to let go, then repeat."
    TABLE_ONLY = "Nothing was measured: the arm is the one of the anthropometric table."
    NO_INTERVAL = (
        "The motion is over. This method states no uncertainty, so it is not known whether the arm is identified."
    )

    @property
    def sentence(self) -> Sentence:
        """Value of the outcome, with the code of its translations."""
        return member_sentence("outcome", self)


@dataclass(frozen=True)
class Agreement:
    """Result of a check at postures that the estimate has not used."""

    p: Joints
    """Probability of residuals at least as large as found, if the estimate is right, by joint [-]."""

    residual: Joints
    """Mean residual torque at the postures, RMS over the postures [N·m]."""

    expected: Joints
    """RMS of that residual by the estimate's uncertainty, the discrepancy, the noise and the wearer [N·m]."""

    least_p: float
    """Probability below which a joint disagrees [-]."""

    @property
    def holds(self) -> bool:
        """True if no joint disagrees."""
        return bool((self.p >= self.least_p).all())


@dataclass(frozen=True)
class Estimate:
    """Estimate after some motion."""

    t: float
    """Time of motion used [s]."""

    x: Parameters
    """Parameters in the model's order, physically possible."""

    covariance: Covariance | None
    """Covariance of `x`; None if the method states no uncertainty."""

    rejected_share: float
    """Share of the samples that received less than half their weight [-]."""

    noise_scale: float
    """Ratio of the size of the wearer's slow torque to the assumed size [-]; 1 if the method does not estimate it."""

    slipped: Float[np.ndarray, " cuff"] | None = None
    """Distance by which each cuff has slipped along the limb, RMS over the motion [m]; None if it is not estimated."""

    @property
    def sd(self) -> Parameters:
        """Standard deviation of each parameter; NaN if the method states no uncertainty."""
        if self.covariance is None:
            return np.full_like(self.x, np.nan)
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


@runtime_checkable
class TorqueModel(Protocol):
    """Interface of a model: the expected torque of a motion, and its derivative with respect to the parameters."""

    n_joints: int
    n_parameters: int

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] at `x`, and its derivative with respect to `x`."""
        ...

    def restart(self) -> None:
        """Start a new motion: the next sample does not continue the previous one."""
        ...

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m] from an uncertain direction of motion at `v` [rad/s]."""
        ...


@runtime_checkable
class Method(Protocol):
    """Interface of an identification method: it takes samples and returns estimates."""

    name: str

    def update(self, sample: Sample) -> None:
        """Take one sample. Samples arrive in the order of time, at the loop's rate."""
        ...

    def estimate(self) -> Estimate:
        """Estimate from all samples up to now."""
        ...


@runtime_checkable
class Checkable(Method, Protocol):
    """Method that can test its estimate at postures that it has not used."""

    def hold_out(self, postures: Float[np.ndarray, "posture joint"]) -> None:
        """Remember the estimate up to now; the following samples, at `postures` [rad], test it."""
        ...

    def agreement(self) -> Agreement | None:
        """Test the remembered estimate by the samples since `hold_out`; None without such samples."""
        ...


@dataclass(frozen=True)
class Rest:
    """Posture in which the relaxed arm was held at rest, with the averaged measurements."""

    q: Joints
    """Joint position at rest [rad]."""

    tau: Joints
    """Motor torque from the current, friction included [N·m]."""

    wrenches: Float[np.ndarray, "cuff 6"]
    """Force [N] and moment [N·m] of each cuff on the arm, as in `rig.interface.CuffSensing`."""

    seconds: float
    """Duration of the rest, travel to the posture included [s]."""


@runtime_checkable
class RestingMethod(Method, Protocol):
    """Method that learns from resting postures before any motion; `update` only advances its clock."""

    rests_needed: int

    rest_s: float
    """Total duration of the rests [s]; a comparison of methods adds it to the time of motion."""

    @property
    def postures(self) -> Float[np.ndarray, "rest joint"]:
        """Postures in which the arm must rest, in this order [rad]."""
        ...

    def take_rests(self, rests: Sequence[Rest]) -> None:
        """Learn from the rests; `rests_needed` of them are required."""
        ...
