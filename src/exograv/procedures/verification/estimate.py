"""Estimate of the left over at the passed postures, with its uncertainty, from the motors' torque alone.

At a posture the motors gave more torque than the model by

    left over + error of the springs of the wearer's joints + friction error ± friction error + slow torque + noise

The mean of both directions removes the friction error that changes its sign with the motion; an average over hours
would remove the slow torque. The error of the identified springs remains: no pass shows how a posture's torque divides
into weight and springs. The identification estimates this, with a covariance from which this estimate starts. In
addition each posture may have an error of its own, whose size is estimated from the data, so that a wrong
identification is not trusted. Joints are estimated separately: an error at one joint does not affect the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance, Estimate
from exograv.identification.core.prior import disturbance_sd, prior
from exograv.identification.core.square_root import square_root
from exograv.procedures.weighing.slow_torque import RegressionRows

from .joint_estimate import JointPasses, Unknowns, rejected_share
from .postures import Postures
from .slow_passes import SAMPLE_S, PassSample

DRAWS = 4000
"""Number of draws of the postures' torques. The ends of a 95 % interval then err by 1/50 of its width."""

SEED = 20_260_107

ENDS = (0.025, 0.975)
"""Quantiles at the ends of a 95 % interval [-]."""

TEXT = "Separating what is left over from muscle torque"

Joints = Float[np.ndarray, " joint"]
Draws = Float[np.ndarray, "draw posture joint"]


@dataclass(frozen=True)
class LeftOver:
    """Left over at each posture, with its uncertainty [N·m]."""

    draws: Draws
    """Draws of the left over, all equally probable."""

    beyond: Postures
    """Mean of both directions of the motors' torque beyond the model, springs included."""

    beyond_sd: Postures
    """Standard deviation of `beyond`, for noise and the wearer's slow torque."""

    noise_scale: float
    """Size of the wearer's unrest at the worst joint, relative to the assumed size [-]."""

    rejected_share: float
    """Share of the samples whose error is more than twice the limit of full weight [-]."""

    @property
    def excludes_nothing(self) -> Bool[np.ndarray, " joint"]:
        """True for joints at which the left over cannot be zero at all postures."""
        from scipy.stats import chi2  # takes 0.3 s to import, which no tick may wait for

        postures = self.draws.shape[1]
        far = [
            m @ np.linalg.solve(np.cov(d.T), m) for d, m in zip(self._by_joint, self.draws.mean(axis=0).T, strict=True)
        ]
        return np.array(far) > chi2.ppf(ENDS[1], postures)

    @property
    def rms(self) -> Float[np.ndarray, "3 joint"]:
        """Left over, RMS over the postures: median and ends of its 95 % interval [N·m].

        The interval begins at zero where the left over may be zero, because the root mean square of draws never is.
        """
        each = np.sqrt(np.mean(self.draws**2, axis=1))
        middle, low, high = np.quantile(each, (0.5, *ENDS), axis=0)
        return np.array([middle, np.where(self.excludes_nothing, low, 0.0), high])

    @property
    def _by_joint(self) -> Float[np.ndarray, "joint draw posture"]:
        return np.moveaxis(self.draws, -1, 0)


class LeftOverEstimator:
    """Estimator of the left over of one identified arm in one machine."""

    def __init__(self, model: ArmModel, arm: Estimate, postures: Postures):
        self._model, self._x, self._postures = model.again(), arm.x, postures
        self._machine = model.machine
        self._spread = square_root(_covariance(arm, model))
        self._slow_sd = disturbance_sd(model.assembly.description.places)
        self._unknowns = Unknowns.of(self._spread.shape[1], len(postures))
        self._sensitivity = np.array([self._model.at_rest(q, arm.x)[1] @ self._spread for q in postures])

    def estimate(
        self, heard: Sequence[PassSample], progress: Callable[[str, float], None] = lambda _text, _share: None
    ) -> LeftOver:
        """Estimate from all samples of all passes; this takes seconds."""
        rows = self._rows(heard)
        joints = [JointPasses(_of(rows, j), self._unknowns, float(sd)) for j, sd in enumerate(self._slow_sd)]
        random = np.random.default_rng(SEED)
        draws, beyond = [], []
        for j, joint in enumerate(joints):
            progress(TEXT, j / len(joints))
            to_torque = np.hstack([self._sensitivity[:, j], np.eye(len(self._postures))])
            draws.append(joint.draw(to_torque, DRAWS, random))
            beyond.append(np.array(joint.beyond()))
        progress(TEXT, 1.0)
        # An error of a motor's gain scales all of its torque.
        gains = 1.0 + self._machine.actuators.gain_sd / self._machine.actuators.gain * random.standard_normal(
            (DRAWS, 1, len(joints))
        )
        middle, sd = np.stack(beyond, axis=-1)
        noise_scale = max(joint.noise_scale for joint in joints)
        return LeftOver(gains * np.stack(draws, axis=-1), middle, sd, noise_scale, rejected_share(joints))

    def _rows(self, heard: Sequence[PassSample]) -> RegressionRows:
        """Return the samples of all joints, linear in their unknowns."""
        rows, posture = [], -1
        for one in heard:
            if one.posture != posture:
                posture = one.posture
                self._model.restart()
            tau, derivative = self._model.linearise(one.sample, self._x)
            white = self._machine.residual_sd * np.sqrt(self._machine.correlation_s / SAMPLE_S)
            noise = np.hypot(white, self._model.direction_uncertainty(one.sample.v))
            rows.append((self._derivative(one, derivative), one.sample.tau - tau, noise))
        H, y, noise = (np.array(column) for column in zip(*rows, strict=True))
        return RegressionRows(np.array([one.sample.t for one in heard]), H, y, noise)

    def _derivative(
        self, one: PassSample, by_parameter: Float[np.ndarray, "joint parameter"]
    ) -> Float[np.ndarray, "joint unknown"]:
        """Return the derivative of each joint's torque by each unknown [N·m]."""
        H = np.zeros((len(one.sample.q), self._unknowns.constant.stop))
        friction, sd = self._machine.friction, self._machine.friction_sd
        H[:, self._unknowns.arm] = by_parameter @ self._spread
        H[:, self._unknowns.own][:, one.posture] = 1.0
        H[:, self._unknowns.turning][:, one.posture] = np.asarray(friction.coulomb) * np.sign(one.sample.v)
        H[:, self._unknowns.constant] = np.asarray(sd.asymmetry)[:, None]
        return H


def _of(rows: RegressionRows, joint: int) -> RegressionRows:
    one = slice(joint, joint + 1)
    return RegressionRows(rows.t, rows.H[:, one], rows.y[:, one], rows.noise[:, one])


def _covariance(arm: Estimate, model: ArmModel) -> Covariance:
    """Return the covariance of the arm's parameters; the prior covariance if the method states none."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
