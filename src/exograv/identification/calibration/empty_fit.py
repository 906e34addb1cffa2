"""Fit of the model of an empty machine to its sweeps: Gauss–Newton, maximum a posteriori."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from exograv import kernel
from exograv.identification.core.correlation import integrated_correlation
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_model import AGE_S, compile_model
from .empty_prior import COULOMB, PER_JOINT, EmptyPrior, Unknowns, data_sheet_prior, usual_friction

V_CLEAR = 0.04
"""Speed below which samples are left out, because friction has no clear direction [rad/s]."""
SINCE_TURN_S = 0.1
"""Time after a reversal in which samples are left out [s]: the sample filter still contains earlier friction."""
V_START = 0.002
"""Speed that represents a start from rest [rad/s]: fast for `empty_model.V_SHARP`, slow for any Stribeck speed."""
START_SD = 0.05
"""Standard deviation of a start, as a share of the usual Coulomb friction [-]: a push grows by this much while a joint
creeps before it slides."""
SAMPLE_PERIOD_S = 0.04
ITERATIONS = 40
STEP_MAX_SD = 1.5  # prior standard deviations: a Stribeck speed must not jump out of the measured range of speeds
SETTLED_SD = 0.01  # a step that is this small against the uncertainty is negligible
FIRST_NOISE_NM = 0.2  # before the residuals are known

Joints = Float[np.ndarray, " joint"]
Samples = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class Sweeps:
    """Measurements on the empty machine, one row per sample: sweeps, `SAMPLE_PERIOD_S` apart, and starts from rest.

    A start gives the torque at which a joint began to move: a sample at ± `V_START` without acceleration.
    """

    t: Float[np.ndarray, " sample"]
    """Time on the rig's clock [s]."""

    q: Samples
    v: Samples
    a: Samples
    current: Samples
    """Motor current [A]."""

    hung: Float[np.ndarray, "sample hanging"]
    """Presence of each known weight at each mount: 1 if it hangs there, else 0 [-].

    The order is mount × weight: all weights of the first mount come first.
    """

    start: Bool[np.ndarray, " sample"]
    """True if the row is a start from rest."""

    v_clear: float = field(default=V_CLEAR, kw_only=True)
    """Speed below which samples are left out [rad/s]."""

    slides: Bool[np.ndarray, "sample joint"] | None = field(default=None, kw_only=True)
    """True where a joint has gone far enough since its last reversal for its whole friction; None if not known."""

    wrench: Float[np.ndarray, "sample 6"] | None = field(default=None, kw_only=True)
    """Measured wrench on the machine: force [N] and moment [N·m] at the frame of the sensor; None without a sensor."""

    @property
    def clear(self) -> Bool[np.ndarray, "sample joint"]:
        """True where friction has a clear direction."""
        slowest = np.where(self.start[:, None], 0.0, np.maximum(self.v_clear, SINCE_TURN_S * np.abs(self.a)))
        is_fast = np.abs(self.v) > slowest
        return is_fast if self.slides is None else is_fast & self.slides


@dataclass(frozen=True)
class ResidualNoise:
    """Size and correlation time of a residual, per joint."""

    sd: Joints
    """Standard deviation of the residual [N·m]."""
    correlation_s: Joints
    """Integrated autocorrelation time [s]."""


@dataclass(frozen=True)
class _Left:
    """Residuals of the nominal torque, without and with the torque ripple left in [N·m]."""

    residual: Samples
    with_ripple: Samples
    """Residual that still contains the torque ripple, because the model is evaluated without ripple [N·m]."""


@dataclass(frozen=True)
class Fit:
    """Result of one fit of the empty machine: parameters, covariance and noise."""

    prior: EmptyPrior
    theta: Unknowns
    covariance: Float[np.ndarray, "unknown unknown"]
    noise: ResidualNoise
    """Noise of the residual with the ripple removed."""
    noise_and_ripple: ResidualNoise
    """Noise of the residual that still contains the ripple."""

    @property
    def sd(self) -> Unknowns:
        """Standard deviation of each unknown."""
        return np.sqrt(np.diag(self.covariance))


class EmptyMachine:
    """Model of an empty machine, compiled once, with the fit to its sweeps."""

    def __init__(
        self,
        description: RigDescription,
        tree: Tree,
        per_joint: tuple[str, ...] = PER_JOINT,
        force_frame: str | None = None,
    ):
        """Compile the model; a force sensor measures at `force_frame`, None without one."""
        self.description, self._has_force_sensor = description, force_frame is not None
        self.prior = data_sheet_prior(description, tree, per_joint)
        self._start_sd = START_SD * usual_friction(description, COULOMB)[0]
        self.batch = compile_model(description, tree, self.prior.layout, force_frame)

    def fit(self, sweeps: Sweeps, prior: EmptyPrior, first: Fit | None = None) -> Fit:
        """Fit the maximum a posteriori; a `first` fit gives size and correlation of the residuals.

        The current is the output of the model: as a regressor, its noise would bias the gain towards zero.
        """
        clear = sweeps.clear
        noise, repeats = np.full(clear.shape[1], FIRST_NOISE_NM), np.ones(clear.shape[1])
        if first is not None:
            noise, repeats = first.noise.sd, np.maximum(first.noise.correlation_s / SAMPLE_PERIOD_S, 1.0)
        # The errors of all starts of a joint are the same, so that their number must not reduce the variance.
        starts = np.maximum((clear & sweeps.start[:, None]).sum(axis=0), 1)
        of_start = np.hypot(noise, self._start_sd * np.sqrt(starts))
        sd = np.where(sweeps.start[:, None], of_start, noise * np.sqrt(repeats))
        weight = np.where(clear, 1.0 / sd, 0.0)
        theta, covariance, left = self._descend(sweeps, prior, prior.mean if first is None else first.theta, weight)
        moving = clear & ~sweeps.start[:, None]
        return Fit(prior, theta, covariance, _noise(left.residual, moving), _noise(left.with_ripple, moving))

    def residual(self, sweeps: Sweeps, theta: Unknowns, t_end: float) -> Samples:
        """Nominal torque of samples that the parameters leave unexplained [N·m]; ages count back from `t_end` [s]."""
        samples = self._bound(sweeps, t_end)
        samples.inputs["theta"][:] = theta
        samples()
        return self.description.nominal_gain * sweeps.current - samples.outputs["tau"].T

    def derivative(self, sweeps: Sweeps, theta: Unknowns) -> Float[np.ndarray, "joint unknown sample"]:
        """Differentiate the nominal torque of samples by the unknowns; ages count back from the last sample."""
        samples = self._bound(sweeps, float(sweeps.t[-1]))
        samples.inputs["theta"][:] = theta
        samples()
        return samples.outputs["derivative"].copy()

    def _bound(self, sweeps: Sweeps, t_end: float) -> kernel.BoundBatch:
        samples = self.batch.bind(len(sweeps.q))
        for name in ("q", "v", "a", "hung"):
            samples.inputs[name][...] = getattr(sweeps, name).T
        samples.inputs["age"][...] = (t_end - sweeps.t) / AGE_S
        assert sweeps.wrench is None or self._has_force_sensor, "forces need the frame of their sensor"
        samples.inputs["wrench"][...] = 0.0 if sweeps.wrench is None else sweeps.wrench.T
        return samples

    def _descend(
        self, sweeps: Sweeps, prior: EmptyPrior, theta: Unknowns, weight: Samples
    ) -> tuple[Unknowns, Float[np.ndarray, "unknown unknown"], "_Left"]:
        """Run Gauss–Newton from `theta` to the optimum; each sample and joint has its weight [1/(N·m)]."""
        tau_nominal = self.description.nominal_gain * sweeps.current
        samples = self._bound(sweeps, float(sweeps.t[-1]))
        by_prior, prior_sd = np.linalg.inv(prior.covariance), np.sqrt(np.diag(prior.covariance))
        covariance = prior.covariance
        tau, derivative, residual = samples.outputs["tau"], samples.outputs["derivative"], np.empty_like(tau_nominal)
        for _ in range(ITERATIONS):
            samples.inputs["theta"][:] = theta
            samples()
            residual = tau_nominal - tau.T
            information, slope = by_prior.copy(), by_prior @ (prior.mean - theta)
            for of_joint, error, w in zip(derivative, residual.T, weight.T, strict=True):
                counts = w > 0.0
                weighted = w[counts] * of_joint[:, counts]
                information += weighted @ weighted.T
                slope += weighted @ (w * error)[counts]
            covariance = np.linalg.inv(information)
            step = covariance @ slope
            step *= min(1.0, STEP_MAX_SD / np.abs(step / prior_sd).max())
            theta = theta + step
            if np.abs(step / np.sqrt(np.diag(covariance))).max() < SETTLED_SD:
                break
        ripple = np.r_[prior.layout.of("ripple_sine"), prior.layout.of("ripple_cosine")]
        with_ripple = residual + np.einsum("jus,u->sj", derivative[:, ripple], theta[ripple])
        return theta, covariance, _Left(residual, with_ripple)


def _noise(residual: Samples, counts: Bool[np.ndarray, "sample joint"]) -> ResidualNoise:
    noise_sd = np.sqrt(np.nanmean(np.where(counts, residual, np.nan) ** 2, axis=0))
    times = [integrated_correlation(r[c], SAMPLE_PERIOD_S) for r, c in zip(residual.T, counts.T, strict=True)]
    return ResidualNoise(noise_sd, np.array(times))
