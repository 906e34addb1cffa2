"""Fits the model of an empty machine to its sweeps: Gauss–Newton, maximum a posteriori."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.identification.core.correlation import integrated_correlation
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_model import AGE_S, compile_model
from .empty_prior import COULOMB, EmptyPrior, Unknowns, data_sheet_prior, usual_friction

V_CLEAR = 0.04
"""Slower samples are left out: there friction has no clear direction [rad/s]."""
SINCE_TURN_S = 0.1
"""Nor is it clear so soon after a turn: the samples' filter still holds some of the friction before it [s]."""
V_START = 0.002
"""Stands for a start from rest: fast for `empty_model.V_SHARP`, slow for any Stribeck speed [rad/s]."""
START_SD = 0.05
"""Of the usual Coulomb friction: what a push grows by while a joint creeps that does not yet slide [-]."""
SAMPLE_PERIOD_S = 0.04
ITERATIONS = 40
STEP_MAX_SD = 1.5  # prior standard deviations: a Stribeck speed must not leap over all speeds that were seen
SETTLED_SD = 0.01  # a step this small against the uncertainty changes nothing
FIRST_NOISE_NM = 0.2  # before the residuals are known

Joints = Float[np.ndarray, " joint"]
Samples = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class Sweeps:
    """What was measured on the empty machine, one row a sample: sweeps, `SAMPLE_PERIOD_S` apart, and starts from rest.

    A start is what it took to move a joint: a sample at ± `V_START` without acceleration.
    """

    t: Float[np.ndarray, " sample"]
    """On the rig's clock [s]."""

    q: Samples
    v: Samples
    a: Samples
    current: Samples
    """[A]"""

    hung: Float[np.ndarray, "sample hanging"]
    """Which known weight hangs at which mount [-]: mount × weight, all weights of the first mount first."""

    start: Bool[np.ndarray, " sample"]
    """Whether the row is a start from rest."""

    @property
    def clear(self) -> Bool[np.ndarray, "sample joint"]:
        """Where friction has a clear direction."""
        slowest = np.where(self.start[:, None], 0.0, np.maximum(V_CLEAR, SINCE_TURN_S * np.abs(self.a)))
        return np.abs(self.v) > slowest


@dataclass(frozen=True)
class ResidualNoise:
    """A residual in two numbers a joint."""

    sd: Joints
    """[N·m]"""
    correlation_s: Joints
    """Integrated autocorrelation time [s]."""


@dataclass(frozen=True)
class _Left:
    """What a model leaves of the nominal torque [N·m]."""

    residual: Samples
    with_ripple: Samples
    """Where it does not know the ripple."""


@dataclass(frozen=True)
class Fit:
    """Where a fit ended."""

    prior: EmptyPrior
    theta: Unknowns
    covariance: Float[np.ndarray, "unknown unknown"]
    noise: ResidualNoise
    """What the fit leaves of the nominal torque."""
    noise_and_ripple: ResidualNoise
    """The same for a model without ripple."""

    @property
    def sd(self) -> Unknowns:
        """Standard deviation of each unknown."""
        return np.sqrt(np.diag(self.covariance))


class EmptyMachine:
    """The model of a machine, compiled once, to be fitted to its sweeps."""

    def __init__(self, description: RigDescription, tree: Tree):
        self.description = description
        self.prior = data_sheet_prior(description, tree)
        self._start_sd = START_SD * usual_friction(description, COULOMB)[0]
        self.batch = compile_model(description, tree, self.prior.layout)

    def fit(self, sweeps: Sweeps, prior: EmptyPrior, first: Fit | None = None) -> Fit:
        """Maximum a posteriori; a `first` fit tells how large and how correlated the residuals are.

        The current stands on the output side: as a regressor its noise would shrink the gain.
        """
        clear = sweeps.clear
        noise, repeats = np.full(clear.shape[1], FIRST_NOISE_NM), np.ones(clear.shape[1])
        if first is not None:
            noise, repeats = first.noise.sd, np.maximum(first.noise.correlation_s / SAMPLE_PERIOD_S, 1.0)
        # What is wrong with one start is wrong with all of a joint.
        starts = np.maximum((clear & sweeps.start[:, None]).sum(axis=0), 1)
        of_start = np.hypot(noise, self._start_sd * np.sqrt(starts))
        sd = np.where(sweeps.start[:, None], of_start, noise * np.sqrt(repeats))
        weight = np.where(clear, 1.0 / sd, 0.0)
        theta, covariance, left = self._descend(sweeps, prior, prior.mean if first is None else first.theta, weight)
        moving = clear & ~sweeps.start[:, None]
        return Fit(prior, theta, covariance, _noise(left.residual, moving), _noise(left.with_ripple, moving))

    def _descend(
        self, sweeps: Sweeps, prior: EmptyPrior, theta: Unknowns, weight: Samples
    ) -> tuple[Unknowns, Float[np.ndarray, "unknown unknown"], "_Left"]:
        """Gauss–Newton from `theta` to the optimum; each sample and joint with its weight [1/(N·m)]."""
        tau_nominal = self.description.nominal_gain * sweeps.current
        samples = self.batch.bind(len(sweeps.q))
        for name in ("q", "v", "a", "hung"):
            samples.inputs[name][...] = getattr(sweeps, name).T
        samples.inputs["age"][...] = (sweeps.t[-1] - sweeps.t) / AGE_S
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
