"""Design of the motion that tells most about the parameters of a machine that its recordings tell least.

The criterion is the mean variance of the parameters after the motion, in variances of their prior: a parameter that the
recordings do not tell counts most. The information of a motion is that of the fit: the same model, noise and
correlation time of the residuals, and samples left out after reversals. What the motion is expected to tell includes
the discrepancy of the model: it is in further samples, too, and their number does not reduce it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, Sweeps
from exograv.identification.excitation.basis import Basis, Coefficients, harmonic
from exograv.identification.excitation.limits import A_MAX, MARGIN_DEG, OFF_STOPS_RAD, TORQUE_SHARE, V_MAX
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .machine_fit import MachineFit
from .measured_motion import V_CLEAR_TWIN, slides
from .model_discrepancy import Considered

PERIOD_S, HARMONICS = 30.0, 12
"""Period [s] and harmonics of a motion: it holds slow and fast parts."""

STARTS, STEPS = 24, 160
"""Number of random motions, and of random steps from the best of them."""

STEP_SHARE = 0.35
"""Size of a first step, as a share of the amplitudes [-]; it shrinks to a tenth."""

GRID = 600
"""Samples of a period at which limits are checked."""

SEED = 34


@dataclass(frozen=True)
class MotionDesign:
    """Motion with the standard deviations before and after it."""

    basis: Basis
    coefficients: Coefficients
    sd_before: Float[np.ndarray, " unknown"]
    sd_after: Float[np.ndarray, " unknown"]
    """Standard deviations that one period of the motion leaves, if residuals are noise."""


@dataclass(frozen=True)
class EmptyLimits:
    """Limits of the empty machine's joints."""

    lower: Float[np.ndarray, " joint"]
    upper: Float[np.ndarray, " joint"]
    tau_max: Float[np.ndarray, " joint"]

    @classmethod
    def of(cls, description: RigDescription, tree: Tree) -> "EmptyLimits":
        """Task workspace with the usual margin, inside the limits of the joints."""
        margin = np.deg2rad([MARGIN_DEG[place] for place in description.places])
        lower, upper = description.workspace
        return cls(
            np.maximum(lower - margin, [joint.lower + OFF_STOPS_RAD for joint in tree.joints]),
            np.minimum(upper + margin, [joint.upper - OFF_STOPS_RAD for joint in tree.joints]),
            TORQUE_SHARE * description.per_actuator("torque_max_Nm"),
        )

    def within(self, basis: Basis, coefficients: Coefficients) -> Coefficients:
        """Scale and shift a motion into the ranges of posture, speed and acceleration, between samples, too."""
        over = basis.overshoot(GRID)
        way, v, a = (over * (table[:, 1:] @ coefficients[1:]) for table in basis.tables(_grid(basis, GRID)))
        low, high = way.min(axis=0), way.max(axis=0)
        # A joint may lack room at one speed only: each joint has its own scale.
        scale = np.minimum(V_MAX / _peak(v), A_MAX / _peak(a))
        scale = np.minimum(np.minimum(scale, (self.upper - self.lower) / np.maximum(high - low, 1e-9)), 1.0) * 0.999
        fitted = coefficients.copy()
        fitted[1:] *= scale
        low, high = fitted[0] + scale * low, fitted[0] + scale * high
        fitted[0] += np.maximum(self.lower - low, 0.0) - np.maximum(high - self.upper, 0.0)
        return fitted


def design_further_motion(
    model: EmptyMachine,
    fit: Fit,
    limits: EmptyLimits,
    parameters: Int[np.ndarray, " chosen"],
    progress: Callable[[float], None] = lambda _share: None,
) -> MotionDesign:
    """Search the motion after which the mean variance of some parameters is smallest.

    Args:
        model: Model of the fit.
        fit: Fit to the present recordings.
        limits: Limits of the machine.
        parameters: Places of the parameters that count, among the unknowns.
        progress: Callback with the finished share [-].
    """
    draw, basis = np.random.default_rng(SEED), harmonic(PERIOD_S, HARMONICS)
    criterion = _Criterion(model, fit, limits, basis, parameters)
    joints, shapes = len(limits.lower), 1 + 2 * HARMONICS
    waves = np.concatenate([[1.0], np.tile(np.arange(1.0, HARMONICS + 1), 2)])
    room, middle = limits.upper - limits.lower, 0.5 * (limits.upper + limits.lower)

    def random_motion() -> Coefficients:
        slope = draw.uniform(0.0, 1.5)
        amplitudes = draw.standard_normal((shapes, joints)) * room / waves[:, None] ** slope
        amplitudes[0] = middle + 0.2 * room * draw.uniform(-1.0, 1.0, joints)
        return limits.within(basis, amplitudes)

    motions = [random_motion() for _ in range(STARTS)]
    merits = [criterion.merit(one) for one in motions]
    best, merit = motions[int(np.argmin(merits))], min(merits)
    for step in range(STEPS):
        size = STEP_SHARE * 0.1 ** (step / STEPS) * np.abs(best[1:]).mean()
        moved = best.copy()
        moved[1:] += size * draw.standard_normal(moved[1:].shape) * draw.integers(0, 2, joints)
        moved[0] += 0.1 * size * draw.standard_normal(joints)
        tried = limits.within(basis, moved)
        if (other := criterion.merit(tried)) < merit:
            best, merit = tried, other
        progress((step + 1) / STEPS)
    before, after = fit.covariance, criterion.covariance(best)
    return MotionDesign(basis, best, np.sqrt(np.diag(before)), np.sqrt(np.diag(after)))


def expected_ratio(found: MachineFit, limits: EmptyLimits, design: MotionDesign) -> Float[np.ndarray, " unknown"]:
    """Predict standard deviations after one period of a motion over those before, with the model's discrepancy [-].

    The ratio is at most 1. Beyond it, the discrepancy in the motion harms the fit more than the motion helps.
    """
    model, fit = found.model, found.fit
    samples = _Criterion(model, fit, limits, design.basis, np.arange(0)).samples(design.coefficients)
    sd_before, sd_after = (
        np.sqrt(np.diag(Considered(model, sweeps).covariance(_by_noise(model, fit, sweeps), found.discrepancy)))
        for sweeps in (found.sweeps, _joined(found.sweeps, samples))
    )
    return np.minimum(sd_after / sd_before, 1.0)


def _by_noise(model: EmptyMachine, fit: Fit, sweeps: Sweeps) -> Fit:
    """Return the fit with the covariance that these samples leave by their noise, without the model's discrepancy.

    The effect of the discrepancy is P JᵀW E. P and J must belong to the same values: leads of the motors' encoders move
    the values after the fit, and a covariance of other values makes the effect several times too large.
    """
    information, clear = np.linalg.inv(fit.prior.covariance), sweeps.clear
    for of_joint, counts, weight in zip(model.derivative(sweeps, fit.theta), clear.T, _weight(fit), strict=True):
        weighted = weight * of_joint[:, counts]
        information += weighted @ weighted.T
    return replace(fit, covariance=np.linalg.inv(information))


def _weight(fit: Fit) -> Float[np.ndarray, " joint"]:
    """Root of the weight of a sample in a fit: residuals that repeat each other count once [1/(N·m)]."""
    return 1.0 / (fit.noise.sd * np.sqrt(np.maximum(fit.noise.correlation_s / SAMPLE_PERIOD_S, 1.0)))


def _joined(first: Sweeps, second: Sweeps) -> Sweeps:
    """Return the samples of two motions, the second after the first and without a force sensor."""
    t = np.concatenate([first.t, first.t[-1] + SAMPLE_PERIOD_S + second.t])
    names = ("q", "v", "a", "current", "hung", "start")
    rows = (np.concatenate([getattr(first, name), getattr(second, name)]) for name in names)
    far = [np.ones(one.q.shape, dtype=bool) if one.slides is None else one.slides for one in (first, second)]
    wrench = (
        None if first.wrench is None else np.vstack([first.wrench, np.zeros((len(second.t), first.wrench.shape[1]))])
    )
    return Sweeps(t, *rows, v_clear=V_CLEAR_TWIN, slides=np.concatenate(far), wrench=wrench)


class _Criterion:
    """Mean variance of the parameters after a motion, over that of their prior."""

    def __init__(
        self,
        model: EmptyMachine,
        fit: Fit,
        limits: EmptyLimits,
        basis: Basis,
        parameters: Int[np.ndarray, " chosen"],
    ):
        self._model, self._fit, self._limits, self._parameters = model, fit, limits, parameters
        self._t = _grid(basis, round(basis.period_s / SAMPLE_PERIOD_S))
        self._tables = basis.tables(self._t)
        self._samples = model.batch.bind(len(self._t))
        self._samples.inputs["theta"][:] = fit.theta
        self._samples.inputs["age"][...] = 0.0
        self._samples.inputs["hung"][...] = 0.0
        self._samples.inputs["wrench"][...] = 0.0
        self._known = np.linalg.inv(fit.covariance)
        self._weight = _weight(fit)

    def merit(self, coefficients: Coefficients) -> float:
        """Criterion of a motion; infinite if it needs too much torque."""
        covariance = self.covariance(coefficients)
        if (np.abs(self._samples.outputs["tau"]).max(axis=1) > self._limits.tau_max).any():
            return float("inf")
        k = self._parameters
        return float(np.mean(np.diag(covariance)[k] / np.diag(self._fit.prior.covariance)[k]))

    def samples(self, coefficients: Coefficients) -> Sweeps:
        """Return samples of one period of the motion, with the current that the fitted machine needs."""
        q, v, a = (table @ coefficients for table in self._tables)
        for name, values in (("q", q), ("v", v), ("a", a)):
            self._samples.inputs[name][...] = values.T
        self._samples()
        current = self._samples.outputs["tau"].T / self._model.description.nominal_gain
        none = np.zeros((len(q), self._samples.inputs["hung"].shape[0]))
        still = np.zeros(len(q), dtype=bool)
        return Sweeps(self._t, q, v, a, current, none, still, v_clear=V_CLEAR_TWIN, slides=slides(q))

    def covariance(self, coefficients: Coefficients) -> Float[np.ndarray, "unknown unknown"]:
        """Covariance of all unknowns after one period of the motion."""
        clear, information = self.samples(coefficients).clear, self._known.copy()
        for of_joint, counts, weight in zip(self._samples.outputs["derivative"], clear.T, self._weight, strict=True):
            weighted = weight * of_joint[:, counts]
            information += weighted @ weighted.T
        return np.linalg.inv(information)


def _grid(basis: Basis, samples: int) -> Float[np.ndarray, " sample"]:
    return np.arange(samples) * basis.period_s / samples


def _peak(rows: Float[np.ndarray, "sample joint"]) -> Float[np.ndarray, " joint"]:
    return np.maximum(np.abs(rows).max(axis=0), 1e-9)
