"""Our method: a Bayesian information filter from the table's prior, with the wearer's restlessness in its state."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .discrepancy import Discrepancy
from .interface import Covariance, Estimate, Joints, Parameters, Sample, TorqueModel
from .physical import PhysicalProjection
from .square_root import GATE, FilterBank


@dataclass(frozen=True)
class Noise:
    """What the expected torque cannot explain."""

    sd: Joints
    """Of the calibrated machine's residual [N·m]."""

    correlation_s: Joints
    """Its integrated autocorrelation time [s]."""

    disturbance_sd: Joints
    """Size of a slow disturbance, as assumed [N·m]: a wearer who does not quite relax, and errors of the model that
    change with the posture. The filter weighs multiples of it by the data."""

    disturbance_correlation_s: float = 3.0
    """Of the slow disturbance [s]; people: 1-5 s (docs/arm.md)."""


DISTURBANCE_SCALES = np.array([0.3, 0.6, 1.2, 2.4, 4.8])
"""Multiples of `Noise.disturbance_sd` that are weighed against each other [-]."""

UNLIKELY = 1e-3
"""Probability below which an assumed size is not carried on at the next linearisation [-]."""

UPDATE_PERIOD_S = 0.08
"""The motion is slow and the filter's corner at 7 Hz: more samples would only repeat each other."""

PLAUSIBLE_SD = 2.5
"""Standard deviations from the prior up to which the model is linearised; the estimate itself may go farther."""

RELINEARISE_FIRST_S, RELINEARISE_GROWTH = 2.0, 1.6
"""When all samples are linearised anew: after 2 s of motion, then at times that grow geometrically."""


class Recursive:
    """`Method` for any `TorqueModel`; linearised at the newest estimate, robust to bursts, physical when published."""

    name = "recursive"

    def __init__(
        self,
        model: TorqueModel,
        mean: Parameters,
        covariance: Covariance,
        noise: Noise,
        bodies: tuple[slice, ...],
        discrepancy: Discrepancy | None = None,
    ):
        self._model, self._noise, self._discrepancy = model, noise, discrepancy
        self._mean = mean
        self._unwhiten = _square_root(covariance)
        self._free = self._unwhiten.shape[1]
        self._scales = DISTURBANCE_SCALES
        self._bank = self._empty_bank()
        self._project = PhysicalProjection(bodies, mean)
        self._x = mean.copy()
        self._t = 0.0
        self._history: list[Sample] = []
        self._relinearise_t = RELINEARISE_FIRST_S
        self._samples = 0
        self._rejected = 0

    def update(self, sample: Sample) -> None:
        """Take one sample; those within `UPDATE_PERIOD_S` of the last used one are passed over."""
        self._t = sample.t
        if self._history and sample.t - self._history[-1].t < UPDATE_PERIOD_S - 1e-9:
            return
        kept = Sample(sample.t, sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy())
        self._take(kept)
        self._history.append(kept)
        if sample.t >= self._relinearise_t:
            self.relinearise()
            self._relinearise_t *= RELINEARISE_GROWTH

    def relinearise(self) -> None:
        """Run over all samples again, linearised at the newest estimate: one Gauss–Newton step of the whole batch.

        What was learned at the wrong place (a shoulder centimetres off) is forgotten that way. It takes some
        milliseconds per second of motion and belongs to a worker, not to the loop.
        """
        history, self._history = self._history, []
        self._scales = self._plausible_scales()
        self._bank = self._empty_bank()
        self._samples = self._rejected = 0
        self._model.restart()
        frozen = self._x.copy()
        for sample in history:
            self._take(sample, frozen)
            self._history.append(sample)
        self._x = self._plausible()

    def _take(self, sample: Sample, x_linear: Parameters | None = None) -> None:
        dt = min(sample.t - self._history[-1].t, 1.0) if self._history else 1.0
        x = self._x if x_linear is None else x_linear
        tau, derivative = self._model.linearise(sample, x)
        H = derivative @ self._unwhiten
        y = sample.tau - tau + derivative @ (x - self._mean)
        # A correlated residual says less: its variance grows by the number of samples that say the same.
        repeats = np.maximum(self._noise.correlation_s / dt, 1.0)
        noise_sd = np.hypot(self._noise.sd * np.sqrt(repeats), self._model.direction_uncertainty(sample.v))
        noise_sd, surprise = self._bank.held_back(dt, H, y, noise_sd)
        self._samples += 1
        self._rejected += int(surprise > 2 * GATE)
        errors = None if self._discrepancy is None else self._discrepancy.errors(sample.q)
        self._bank.update(dt, H, y, noise_sd, errors)
        if x_linear is None and self._samples % 5 == 0:
            self._x = self._plausible()

    def estimate(self) -> Estimate:
        """What is known now; bodies projected onto possible ones."""
        covariance = self.covariance()
        x = self._project(self._mean + self._unwhiten @ self._bank.mean(), covariance)
        scale = float(self._bank.weights @ self._scales)
        return Estimate(self._t, x, covariance, self._rejected / max(self._samples, 1), scale)

    def _plausible(self) -> Parameters:
        """Where to linearise: the mean, but not beyond `PLAUSIBLE_SD`: early, a few samples can point anywhere."""
        return self._mean + self._unwhiten @ np.clip(self._bank.mean(), -PLAUSIBLE_SD, PLAUSIBLE_SD)

    def _plausible_scales(self) -> Float[np.ndarray, " scale"]:
        """Sizes of the disturbance worth a filter: what the data leave, and the neighbours of the best.

        Neighbours, because a person may grow restless later.
        """
        weights = self._bank.weights
        likely = self._scales[weights > UNLIKELY]
        best = int(np.searchsorted(DISTURBANCE_SCALES, self._scales[int(weights.argmax())]))
        around = DISTURBANCE_SCALES[max(best - 1, 0) : best + 2]
        return np.union1d(likely, around)

    def _empty_bank(self) -> FilterBank:
        considered = 0 if self._discrepancy is None else self._discrepancy.count
        disturbance = self._scales[:, None] * self._noise.disturbance_sd
        return FilterBank(self._free, disturbance, self._noise.disturbance_correlation_s, considered)

    def covariance(self) -> Covariance:
        """Of all parameters."""
        return self._unwhiten @ self._bank.covariance() @ self._unwhiten.T


def _square_root(covariance: Covariance) -> Float[np.ndarray, "parameter free"]:
    """Factor L with L Lᵀ = covariance, scaled first so that small units do not count as singular."""
    sd = np.sqrt(np.diag(covariance))
    known = sd > 0.0
    scale = np.where(known, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = values > 1e-12
    return scale[:, None] * vectors[:, keep] * np.sqrt(values[keep])
