"""Identification of an unloaded robot from its log: links, rotors and friction, as in stage 0 of an exoskeleton.

There are no known weights here, so the user states the torque per current; all results are relative to it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S
from exograv.identification.core.arm_model import SLOW_V
from exograv.identification.core.correlation import integrated_correlation
from exograv.identification.core.interface import Covariance, Joints, Parameters, Sample
from exograv.identification.core.sample_pace import Averages
from exograv.model.tree import Tree

from .payload import PayloadModel, RobotBlocks

# The description is only a prior: published inertias of robot arms are nominal, often those of simple shapes.
LINK_MASS_SD = 0.3  # share
LINK_CENTRE_SD_M = 0.10
LINK_INERTIA_SD = 0.5  # share of the mean moment
# Drives, as shares of the description's effort: friction of a geared joint is some tenths of it.
COULOMB_SD = 0.1  # of the effort
VISCOUS_SD = 1.0  # of effort over speed
ASYMMETRY_SD = 0.02  # of the effort
LOAD_SHARE_SD = 0.1
ROTOR_SD_S = 0.1  # of effort over speed: a drive needs at least a tenth of a second to reach its speed

ROUNDS, ITERATIONS = 3, 8
SETTLED = 0.01  # largest last step, in standard deviations
NOISE_SD_START = 0.02  # of the effort; the first round replaces it
CLEAR_SAMPLES_MIN = 50
FELT_EVERY = 20  # samples
FELT_MIN = 0.03  # RMS torque per standard deviation, as a share of the residual


@dataclass(frozen=True)
class RobotFromLog:
    """Parameters of a robot, identified from its unloaded log."""

    x: Parameters
    """All parameters in the order of `RobotBlocks`; the payload's are zero."""

    covariance: Covariance
    """Covariance of `x`; zero for the payload's entries."""

    residual_sd: Joints
    """Standard deviation of the residual torque in clear motion [N·m]."""

    correlation_s: Joints
    """Integrated autocorrelation time of that residual [s]."""


def robot_from_log(model: PayloadModel, samples: list[Sample]) -> RobotFromLog:
    """Fit the robot to an unloaded motion: Gauss–Newton, maximum a posteriori, with the current as output.

    There are three rounds: each round weights the samples by size and correlation of the previous round's residuals.
    """
    kept = thinned(samples)
    problem = _Fit(model, kept)
    noise_sd = NOISE_SD_START * np.array([joint.effort for joint in model.tree.joints])
    correlation_s = np.full(model.n_joints, SAMPLE_PERIOD_S)
    x = problem.mean
    for _ in range(ROUNDS):
        x, covariance, residual = problem.optimum(
            x, noise_sd * np.sqrt(np.maximum(correlation_s / SAMPLE_PERIOD_S, 1.0))
        )
        noise_sd, correlation_s = _residual_statistics(residual, problem.v, kept)
    return RobotFromLog(x, covariance, noise_sd, correlation_s)  # pyright: ignore[reportPossiblyUnboundVariable] - ROUNDS > 0


def thinned(samples: list[Sample]) -> list[Sample]:
    """Means over `SAMPLE_PERIOD_S`; closer samples repeat each other after the filter."""
    averages = Averages(SAMPLE_PERIOD_S)
    means = (averages.take(sample) for sample in samples)
    return [mean for mean in means if mean is not None]


def felt_covariance(
    model: PayloadModel, robot: RobotFromLog, covariance: Covariance, motion: list[Sample]
) -> Covariance:
    """Covariance (parameter, parameter) without the directions that change no torque in this motion.

    A robot has more inertial parameters than its torques can show; the others would only cost time.

    Args:
        model: Model of the robot with a payload.
        robot: Point of linearisation, and residual that the torques are compared with.
        covariance: Covariance of all parameters; zero for the payload's entries.
        motion: Samples of the motion; their torque is not read.
    """
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0.0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    felt = [model.linearise(s, robot.x)[1] @ root / robot.residual_sd[:, None] for s in motion[::FELT_EVERY]]
    _, strength, directions = np.linalg.svd(np.concatenate(felt), full_matrices=False)
    kept = root @ directions[strength > FELT_MIN * np.sqrt(len(felt))].T
    return kept @ kept.T


def robot_prior(tree: Tree) -> tuple[Parameters, Parameters]:
    """Prior mean and standard deviation of the robot's parameters from its description, without the payload's."""
    effort, speed = (np.array([getattr(joint, name) for joint in tree.joints]) for name in ("effort", "velocity"))
    blocks = RobotBlocks(len(tree.joints))
    mean = np.concatenate([tree.phi.ravel(), np.zeros(5 * blocks.n)])
    sds = [
        ROTOR_SD_S * effort / speed,
        COULOMB_SD * effort,
        VISCOUS_SD * effort / speed,
        np.full(blocks.n, LOAD_SHARE_SD),
        ASYMMETRY_SD * effort,
    ]
    links = [_link_sd(phi) for phi in tree.phi]
    return mean, np.concatenate([*links, *sds])


def _link_sd(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, " 10"]:
    mass, moment = phi[0], (phi[4] + phi[6] + phi[9]) / 3
    inertia = LINK_INERTIA_SD * moment + mass * LINK_CENTRE_SD_M**2
    return np.array([LINK_MASS_SD * mass, *[mass * LINK_CENTRE_SD_M] * 3, *[inertia] * 6])


class _Fit:
    """Weighted least-squares fit of one log, with the description as prior."""

    def __init__(self, model: PayloadModel, samples: list[Sample]):
        self._model, self._samples = model, samples
        self.v = np.array([sample.v for sample in samples])
        prior_mean, prior_sd = robot_prior(model.tree)
        self._information = np.diag(prior_sd**-2.0)
        self.mean = np.concatenate([np.zeros(10), prior_mean])

    def optimum(
        self, x: Parameters, noise_sd: Joints
    ) -> tuple[Parameters, Covariance, Float[np.ndarray, "sample joint"]]:
        """Parameters, their covariance, and residuals [N·m], iterated from a start `x`."""
        step, covariance, residual = self.step(x, noise_sd)
        for _ in range(ITERATIONS):
            x = x + step
            step, covariance, residual = self.step(x, noise_sd)
            if np.all(np.abs(step) <= SETTLED * np.sqrt(np.diag(covariance))):
                break
        return x, covariance, residual

    def step(self, x: Parameters, noise_sd: Joints) -> tuple[Parameters, Covariance, Float[np.ndarray, "sample joint"]]:
        """Gauss–Newton step from `x`, covariance, and residuals at `x` [N·m]."""
        robot = self._model.blocks.robot
        information = self._information.copy()
        slope = self._information @ (self.mean - x)[robot]
        residual = np.empty_like(self.v)
        for i, sample in enumerate(self._samples):
            tau, derivative = self._model.linearise(sample, x)
            residual[i] = sample.tau - tau
            sd = np.hypot(noise_sd, self._model.direction_uncertainty(sample.v))
            weighted = derivative[:, robot] / sd[:, None]
            information += weighted.T @ weighted
            slope += weighted.T @ (residual[i] / sd)
        step, covariance = np.zeros_like(x), np.zeros((len(x), len(x)))
        covariance[robot, robot] = np.linalg.inv(information)
        step[robot] = covariance[robot, robot] @ slope
        return step, covariance, residual


def _residual_statistics(
    residual: Float[np.ndarray, "sample joint"], v: Float[np.ndarray, "sample joint"], samples: list[Sample]
) -> tuple[Joints, Joints]:
    """Return standard deviation [N·m] and integrated autocorrelation time [s] per joint, of samples in clear motion."""
    period_s = samples[1].t - samples[0].t
    sds, correlations = [], []
    for r, speed in zip(residual.T, np.abs(v).T, strict=True):
        clear = r[speed > SLOW_V]
        kept = clear if len(clear) >= CLEAR_SAMPLES_MIN else r
        sds.append(np.sqrt(np.mean(kept**2)))
        correlations.append(integrated_correlation(kept, period_s))
    return np.array(sds), np.array(correlations)
