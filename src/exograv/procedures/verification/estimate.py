"""What is left over at the postures that were passed, with its uncertainty, from the motors' torque alone.

At a posture the motors gave more than the model says by

    left over + what the springs of the wearer's joints are off + friction off ± friction off + slow torque + noise

Both directions together take away the friction that turns its sign with the motion, and hours would take away the slow
torque. What the identified springs are off stays: how a posture's torque divides into weight and springs no pass shows.
The identification knows it, and how well: its covariance is where this estimate starts from. Beside it each posture may
be off by something of its own, of a size that the data weigh: so a wrong identification is not believed. Joint by
joint: what is wrong at one does not count against the others.
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
"""Of the postures' torques: the ends of a 95 % interval are off by a fiftieth of its width."""

SEED = 20_260_107

ENDS = (0.025, 0.975)
"""Of a 95 % interval [-]."""

TEXT = "Telling what is left over from what muscles do"

Joints = Float[np.ndarray, " joint"]
Draws = Float[np.ndarray, "draw posture joint"]


@dataclass(frozen=True)
class LeftOver:
    """What the motors leave over at each posture, as far as the passes tell [N·m]."""

    draws: Draws
    """Possible ones, all alike probable."""

    beyond: Postures
    """Mean of both directions of what the motors gave beyond the model, springs included."""

    beyond_sd: Postures
    """One standard deviation of it, for noise and the wearer's slow torque."""

    noise_scale: float
    """How restless the wearer was at the worst joint, against the assumed size [-]."""

    rejected_share: float
    """Of the samples that surprise by more than twice what is taken in full [-]."""

    @property
    def excludes_nothing(self) -> Bool[np.ndarray, " joint"]:
        """Where it cannot be that nothing is left over at any posture."""
        from scipy.stats import chi2  # 0.3 s that no tick has to wait for

        postures = self.draws.shape[1]
        far = [
            m @ np.linalg.solve(np.cov(d.T), m) for d, m in zip(self._by_joint, self.draws.mean(axis=0).T, strict=True)
        ]
        return np.array(far) > chi2.ppf(ENDS[1], postures)

    @property
    def rms(self) -> Float[np.ndarray, "3 joint"]:
        """Left over, RMS over the postures: median and ends of its 95 % interval [N·m].

        The interval begins at zero where nothing may be left over: a root mean square of possible torques never is.
        """
        each = np.sqrt(np.mean(self.draws**2, axis=1))
        middle, low, high = np.quantile(each, (0.5, *ENDS), axis=0)
        return np.array([middle, np.where(self.excludes_nothing, low, 0.0), high])

    @property
    def _by_joint(self) -> Float[np.ndarray, "joint draw posture"]:
        return np.moveaxis(self.draws, -1, 0)


class LeftOverEstimator:
    """Of one arm in one machine, as identified."""

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
        """From all samples of all passes; seconds pass."""
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
        # A motor that gives more than its calibration says gives as much more of all of it.
        gains = 1.0 + self._machine.actuators.gain_sd / self._machine.actuators.gain * random.standard_normal(
            (DRAWS, 1, len(joints))
        )
        middle, sd = np.stack(beyond, axis=-1)
        noise_scale = max(joint.noise_scale for joint in joints)
        return LeftOver(gains * np.stack(draws, axis=-1), middle, sd, noise_scale, rejected_share(joints))

    def _rows(self, heard: Sequence[PassSample]) -> RegressionRows:
        """All joints' samples, linear in their unknowns."""
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
        """What each unknown adds to the torque of each joint [N·m]."""
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
    """Of the arm; where a method states none, what was believed before it moved."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
