"""What is left over at the postures that were passed, with its uncertainty, from the motors' torque alone.

At a posture the motors gave more than the model says by

    left over + what the springs of the wearer's joints are off + friction off ± friction off + slow torque + noise

Both directions together take away the friction that turns its sign with the motion, and hours would take away the slow
torque. What the identified springs are off stays: how a posture's torque divides into weight and springs no pass shows.
The identification knows it, and how well: its covariance is where this estimate starts from. Beside it each posture and
joint may be off by something of its own, of a size that the data weigh: so a wrong identification is not believed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.arm_model import ArmModel
from exograv.identification.discrepancy import CLOSURE_ERROR_NM
from exograv.identification.interface import Covariance, Estimate
from exograv.identification.pace import BATCH_PERIOD_S
from exograv.identification.prior import disturbance_sd, prior
from exograv.identification.recursive import USUAL_SCALES
from exograv.identification.square_root import GATE, square_root
from exograv.session.weighing.slow_torque import Belief, Information, Rows, believed, told

from .listening import Heard
from .postures import Postures

SIZES = np.geomspace(0.25, 16.0, 7)
"""Of what a posture is off by beyond the identification's own doubt, over what stage 0 left unexplained [-]."""

STEPS = 2
"""The second knows which samples surprise."""

DRAWS = 4000
"""Of the postures' torques: the ends of a 95 % interval are off by a fiftieth of its width."""

SEED = 20_260_107

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
    """How restless the wearer was, against the assumed size [-]."""

    rejected_share: float
    """Of the samples that surprise by more than twice what is taken in full [-]."""

    @property
    def rms(self) -> Float[np.ndarray, "draw joint"]:
        """Over the postures, of each draw [N·m]."""
        return np.sqrt(np.mean(self.draws**2, axis=1))


class LeftOverEstimator:
    """Of one arm in one machine, as identified."""

    def __init__(self, model: ArmModel, arm: Estimate, postures: Postures):
        self._model, self._x, self._postures = model.again(), arm.x, postures
        machine = model.machine
        self._spread = square_root(_covariance(arm, model))
        self._own_sd = np.hypot(CLOSURE_ERROR_NM, machine.residual_sd)
        self._turning_sd = np.asarray(machine.friction.coulomb)
        self._constant_sd = np.asarray(machine.friction_sd.asymmetry)
        self._gain_sd = machine.actuators.gain_sd / machine.actuators.gain
        self._slow_sd = disturbance_sd(model.assembly.description.places)
        self._shape = postures.shape
        arms, each = self._spread.shape[1], postures.size
        self._arm, self._own = slice(0, arms), slice(arms, arms + each)
        self._count = arms + 2 * each + postures.shape[1]
        self._sensitivity = np.array([model.again().at_rest(q, arm.x)[1] @ self._spread for q in postures])

    def estimate(
        self, heard: Sequence[Heard], progress: Callable[[str, float], None] = lambda _text, _share: None
    ) -> LeftOver:
        """From all samples of all passes; seconds pass."""
        rows, expected = self._rows(heard), None
        information: list[Information] = []
        for step in range(STEPS):
            progress("Telling what is left over from what muscles do", (step + 1) / (STEPS + 2))
            information = told([rows], self._slow_sd, expected)
            beliefs, weights = self._beliefs(information)
            expected = np.tensordot(weights, np.array([b.mean for b in beliefs]), axes=1)
        beliefs, weights = self._beliefs(information)
        beyond, beyond_sd = self._beyond(information)
        scales = np.tile(USUAL_SCALES, len(SIZES))
        off = (rows.y - rows.H @ beliefs[int(weights.argmax())].mean) / np.hypot(
            rows.noise, scales[int(weights.argmax())] * self._slow_sd
        )
        return LeftOver(
            self._drawn(beliefs, weights),
            beyond,
            beyond_sd,
            float(weights @ scales),
            float((np.abs(off) > 2 * GATE).any(axis=1).mean()),
        )

    def _beliefs(self, information: Sequence[Information]) -> tuple[list[Belief], Float[np.ndarray, " belief"]]:
        """One for each size of what postures are off by and of the slow torque, with its probability."""
        mean = np.zeros(self._count)
        beliefs = []
        for size in SIZES:
            variance = np.ones(self._count)
            variance[self._own] = size**2
            beliefs += [believed([one], mean, variance) for one in information]
        logs = np.array([belief.log_evidence for belief in beliefs])
        weights = np.exp(logs - logs.max())
        return beliefs, weights / weights.sum()

    def _drawn(self, beliefs: Sequence[Belief], weights: Float[np.ndarray, " belief"]) -> Draws:
        """What the identification is off by, carried to the postures, plus each posture's own."""
        random = np.random.default_rng(SEED)
        own = np.diag(np.tile(self._own_sd, self._shape[0]))
        to_torque = np.hstack([self._sensitivity.reshape(-1, self._arm.stop), own])
        known = slice(0, self._own.stop)
        found = []
        for belief, count in zip(beliefs, random.multinomial(DRAWS, weights), strict=True):
            spread = to_torque @ square_root(belief.covariance[known, known])
            found.append(to_torque @ belief.mean[known] + random.standard_normal((count, spread.shape[1])) @ spread.T)
        draws = np.vstack(found).reshape(-1, *self._shape)
        # A motor that gives more than its calibration says gives as much more of all of it.
        return draws * (1.0 + self._gain_sd * random.standard_normal((len(draws), 1, self._shape[1])))

    def _beyond(self, information: Sequence[Information]) -> tuple[Postures, Postures]:
        """Without any belief about the arm: as measured."""
        variance = np.ones(self._count)
        variance[self._arm] = 1e-12
        variance[self._own] = (SIZES[-1] * 10.0) ** 2
        variance[-self._shape[1] :] = 1e-12
        belief = believed(information, np.zeros(self._count), variance)
        sd = np.sqrt(np.diag(belief.covariance))
        unit = self._own_sd
        return unit * belief.mean[self._own].reshape(self._shape), unit * sd[self._own].reshape(self._shape)

    def _rows(self, heard: Sequence[Heard]) -> Rows:
        machine, rows = self._model.machine, []
        repeats = np.maximum(machine.correlation_s / BATCH_PERIOD_S, 1.0)
        posture = -1
        for one in heard:
            if one.posture != posture:
                posture = one.posture
                self._model.restart()
            sample = one.sample
            tau, derivative = self._model.linearise(sample, self._x)
            noise = np.hypot(machine.residual_sd * np.sqrt(repeats), self._model.direction_uncertainty(sample.v))
            rows.append((self._unknowns(one, derivative), sample.tau - tau, noise))
        H, y, noise = (np.array(column) for column in zip(*rows, strict=True))
        return Rows(np.array([one.sample.t for one in heard]), H, y, noise)

    def _unknowns(
        self, one: Heard, derivative: Float[np.ndarray, "joint parameter"]
    ) -> Float[np.ndarray, "joint unknown"]:
        """What each unknown of standard size adds: the arm's, each posture's own, what turns there, and a constant."""
        postures, n = self._shape
        own, turning = np.zeros((n, postures, n)), np.zeros((n, postures, n))
        own[:, one.posture] = np.diag(self._own_sd)
        turning[:, one.posture] = np.diag(self._turning_sd * np.sign(one.sample.v))
        blocks = [derivative @ self._spread, own.reshape(n, -1), turning.reshape(n, -1), np.diag(self._constant_sd)]
        return np.hstack(blocks)


def _covariance(arm: Estimate, model: ArmModel) -> Covariance:
    """Of the arm; where a method states none, what was believed before it moved."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
