"""Estimate of a weight from two passes of the same path, without and with it, beside errors that look like a weight."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Covariance, Sample
from exograv.identification.core.prior import LENGTH_SD, disturbance_sd
from exograv.identification.core.square_root import square_root
from exograv.model.arm import WeightPlace, held_weight

from .motion_samples import SAMPLE_S
from .slow_torque import RegressionRows, believed, motion_information

WEIGHT_SD_KG = 2.0  # of the prior, with mean zero
PLACE_SD_M = 0.010  # of the weight's place in the hand, or along the forearm
SWING_SD = 0.05  # share of its inertial torque: a weight swings in the soft cuffs by more than they move
STEPS = 2  # Gauss-Newton steps; the second one also knows the samples with unusual errors


@dataclass(frozen=True)
class Weighing:
    """Estimate of an unknown weight, with its uncertainty."""

    mass: float
    """Estimated mass [kg]."""

    sd: float
    """Standard deviation of `mass` [kg]."""

    place: WeightPlace = "hand"

    @property
    def ci95(self) -> tuple[float, float]:
        """Interval of 95 % of the mass [kg]."""
        return self.mass - 1.96 * self.sd, self.mass + 1.96 * self.sd


@dataclass(frozen=True)
class WeightPasses:
    """Samples of the path without and with the weight."""

    empty: Sequence[Sample]
    loaded: Sequence[Sample]


class WeightEstimator:
    """Bayesian estimator of weight and arm together.

    The prior of the arm is its identification. The two passes update the arm, too, so that a model error that both
    passes share does not count as weight. A smooth field of torque over the postures absorbs errors that no parameter
    explains. The weight's place, its swing in the soft cuffs and the motors' gains are considered and not learned:
    their difference from the weight's effect is small, and of the size of the model's errors.
    """

    def __init__(self, model: ArmModel, x: parameters.Parameters, covariance: Covariance, place: WeightPlace):
        self._model, self._x = model.again(), x
        self._place: WeightPlace = place
        assembly, machine = model.assembly, model.machine
        self._phi = parameters.ParameterLayout.of(assembly).phi
        self._spread = square_root(covariance)
        self._sd = disturbance_sd(assembly.description.places)
        self._gain_sd = machine.actuators.gain_sd / machine.actuators.gain
        self._field = Discrepancy(machine.residual_sd, POSTURE_LENGTH_RAD, FEATURES)
        forearm = LENGTH_SD * assembly.arm.lengths["forearm"] * (1.0 if place == "hand" else 0.5)
        farther = float(np.hypot(PLACE_SD_M, forearm))
        self._per_kg = held_weight(assembly.arm, 1.0, at=place)
        self._per_step = held_weight(assembly.arm, 1.0, at=place, farther_m=farther) - self._per_kg

    def weigh(self, passes: WeightPasses, mass: float = 0.0) -> Weighing:
        """Return the weight of the second pass, searched from `mass` [kg]."""
        sd, mean = 0.0, None
        for _ in range(STEPS):
            motions = [self._rows(passes.empty, 0.0, mass), self._rows(passes.loaded, 1.0, mass)]
            unknowns = motions[0].H.shape[2]
            told_by_now = motion_information(motions, self._sd, mean)
            belief = believed(told_by_now, np.zeros(unknowns), np.ones(unknowns), considered=2 + len(self._sd))
            mean, mass = belief.mean, WEIGHT_SD_KG * float(belief.mean[0])
            sd = WEIGHT_SD_KG * float(np.sqrt(belief.covariance[0, 0]))
        return Weighing(mass, sd, self._place)

    def _rows(self, samples: Sequence[Sample], share: float, mass: float) -> RegressionRows:
        """Rows of one pass, linearised at this weight; `share` is 1 with the weight and 0 without."""
        self._model.restart()
        rows = [self._row(sample, share, mass) for sample in samples]
        H, y, noise = (np.array(column) for column in zip(*rows, strict=True))
        return RegressionRows(np.array([sample.t for sample in samples]), H, y, noise)

    def _row(
        self, sample: Sample, share: float, mass: float
    ) -> tuple[Float[np.ndarray, "joint unknown"], Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
        """Return derivative, measurement and noise of one sample.

        The unknowns are weight, arm and field; the rest is considered.
        """
        x = self._x.copy()
        x[self._phi] += share * mass * self._per_kg
        tau, derivative = self._model.linearise(sample, x)
        by_phi = share * derivative[:, self._phi]
        by_weight = (WEIGHT_SD_KG * by_phi @ self._per_kg)[:, None]
        learned = [by_weight, derivative @ self._spread, self._field.errors(sample.q, sample.v)]
        H = np.hstack([*learned, self._considered(sample, x, by_phi, share * mass)])
        y = sample.tau - tau + by_weight[:, 0] * mass / WEIGHT_SD_KG
        machine = self._model.machine
        repeats = np.maximum(machine.correlation_s / SAMPLE_S, 1.0)
        noise = np.hypot(machine.residual_sd * np.sqrt(repeats), self._model.direction_uncertainty(sample.v))
        return H, y, noise

    def _considered(
        self, sample: Sample, x: parameters.Parameters, by_phi: Float[np.ndarray, "joint phi"], mass: float
    ) -> Float[np.ndarray, "joint considered"]:
        """Change of the weight's torque if it is farther out, swings in the cuffs, or the motors have other gains."""
        asked = mass * (by_phi @ self._per_kg)
        if mass == 0.0:
            return np.zeros((len(asked), 2 + len(asked)))
        steady = self._model.linearise(replace(sample, a=np.zeros_like(sample.a)), x)[1][:, self._phi]
        swing = SWING_SD * (asked - mass * (steady @ self._per_kg))
        farther = mass * (by_phi @ self._per_step)
        return np.column_stack([farther, swing, np.diag(self._gain_sd * asked)])
