"""Recursive identification: a Bayesian information filter from the table's prior.

The filter estimates the slow torque of a restless wearer together with the parameters.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.instrument import Instrumented
from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample, TorqueModel
from exograv.identification.core.noise import Noise
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.square_root import GATE, FilterBank, square_root

DISTURBANCE_SCALES = np.array([0.3, 0.6, 1.2, 2.4, 4.8, 9.6])
"""Multiples of `Noise.disturbance_sd` that the filter compares [-]."""

USUAL_SCALES = DISTURBANCE_SCALES[:-1]
"""Multiples for decisions about the person [-]; the largest one would also explain the arm of another person."""

ASKED_ABOVE = 1.5
"""Multiple of `Noise.disturbance_sd` above which rows are taken along the requested motion [-]."""

UNLIKELY = 1e-6
"""Probability below which an assumed size is dropped at the next linearisation [-]."""

PLAUSIBLE_SD = 2.5
"""Largest distance from the prior for linearisation [standard deviations]; the estimate may be farther away."""

RELINEARISE_FIRST_S, RELINEARISE_GROWTH = 2.0, 1.6
"""First time of relinearisation of all samples [s], and the factor to each later time [-]."""


ASTRAY_SD = 4.0
"""Distance from the prior above which the estimate is checked by a second fit [standard deviations]. The first seconds
can lead the non-linear model to a wrong local minimum, where each step looks right."""

FRESH_STEPS = 4
"""Linearisations of the second fit, which starts from the prior."""

REWEIGHTINGS = 2
"""Number of times the samples are reweighted by their residuals, at each linearisation [-]."""


@dataclass(frozen=True)
class _Linear:
    """Samples as linear measurements of the unknowns."""

    dt: Float[np.ndarray, " sample"]
    H: Float[np.ndarray, "sample joint unknown"]
    y: Float[np.ndarray, "sample joint"]
    noise_sd: Float[np.ndarray, "sample joint"]
    errors: Float[np.ndarray, "sample joint considered"] | None


class Recursive:
    """Recursive method for any `TorqueModel`: linearised at the newest estimate, robust to bursts.

    Published estimates are physically possible.
    """

    name = "recursive"

    def __init__(
        self,
        model: TorqueModel,
        mean: Parameters,
        covariance: Covariance,
        noise: Noise,
        bodies: tuple[slice, ...],
        discrepancy: Discrepancy | None = None,
        hidden: int = 0,
    ):
        """Start from the prior.

        Args:
            model: Torque model.
            mean: Prior mean.
            covariance: Prior covariance.
            noise: Noise of the torque.
            bodies: Slices with the inertial parameters of the bodies.
            discrepancy: Model errors that repeat with the posture.
            hidden: Number of parameters at the end that are learned but not published; only this method uses them.
        """
        self._told = len(mean) - hidden
        self._model, self._noise, self._discrepancy = model, noise, discrepancy
        self._mean = mean
        self._unwhiten = square_root(covariance)
        self._free = self._unwhiten.shape[1]
        self._scales = DISTURBANCE_SCALES
        self._bank = self._empty_bank()
        self._project = PhysicalProjection(bodies, mean)
        self._x = mean.copy()
        self._t = 0.0
        self._averages = Averages(BATCH_PERIOD_S)
        self._history: list[Sample] = []
        self._errors: list[np.ndarray] = []
        """Effect of each considered error on each sample; it depends on the motion alone."""
        self._relinearise_t = RELINEARISE_FIRST_S
        self._samples = 0
        self._rejected = 0
        self._choose_rows(False)

    def update(self, sample: Sample) -> None:
        """Take one sample. The filter uses means over 0.08 s."""
        self._t = sample.t
        kept = self._averages.take(sample)
        if kept is None:
            return
        if self._discrepancy is not None:
            self._errors.append(self._discrepancy.errors_of_joint(kept.q, kept.v))
        self._take(kept)
        self._history.append(kept)
        if sample.t >= self._relinearise_t:
            self.relinearise()
            self._relinearise_t *= RELINEARISE_GROWTH

    def relinearise(self) -> None:
        """Repeat the filter over all samples, linearised at the newest estimate: one Gauss–Newton step of the batch.

        This removes errors of early linearisations, for example at a shoulder position that was centimetres off. It
        takes some milliseconds per second of motion, five times as long if the estimate is checked by a second fit.
        Call it in a worker process, not in the loop.
        """
        if not self._history:
            return
        self._choose_rows(self._restlessness() > ASKED_ABOVE)
        self._step()
        if np.abs(self._bank.mean()).max() > ASTRAY_SD:
            self._doubt()

    def _doubt(self) -> None:
        """Fit all samples again from the prior, and keep the fit with the larger evidence."""
        before = self._bank, self._x, self._scales, self._rejected
        self._bank, self._x = self._empty_bank(), self._mean.copy()
        for step in range(FRESH_STEPS):
            self._step(is_last=step == FRESH_STEPS - 1)
        if before[0].log_evidence > self._bank.log_evidence:
            self._bank, self._x, self._scales, self._rejected = before

    def _step(self, is_last: bool = True) -> None:
        """Make one Gauss–Newton step over all samples, with bursts downweighted.

        The considered errors do not change the mean, so only the last pass of the last step carries them.
        """
        self._scales = self._plausible_scales()
        linear, likely = self._linearised(), self._bank
        surprise = np.zeros(len(self._history))
        for reweighting in range(REWEIGHTINGS):
            residual = linear.y - linear.H @ likely.mean()
            noise_sd, surprise = likely.all_held_back(linear.dt, residual, linear.noise_sd)
            considers = is_last and reweighting == REWEIGHTINGS - 1
            likely = self._empty_bank(considers)
            likely.update_all(linear.dt, linear.H, linear.y, noise_sd, linear.errors if considers else None)
        self._bank = likely
        self._samples, self._rejected = len(surprise), int((surprise > 2 * GATE).sum())
        self._x = self._plausible()

    def _linearised(self) -> "_Linear":
        """Return all samples, linearised at the newest estimate."""
        history, x, model = self._history, self._x.copy(), self._model
        model.restart()
        rows = [(*model.linearise(sample, x), model.direction_uncertainty(sample.v)) for sample in history]
        tau, derivative, uncertainty = (np.array(column) for column in zip(*rows, strict=True))
        t, measured = np.array([sample.t for sample in history]), np.array([sample.tau for sample in history])
        dt = np.minimum(np.diff(t, prepend=-np.inf), 1.0)
        flat = derivative.reshape(-1, len(x))
        H = (flat @ self._unwhiten).reshape(*tau.shape, -1)
        y = measured - tau + (flat @ (x - self._mean)).reshape(tau.shape)
        errors = np.array(self._errors) if self._errors else None
        return _Linear(dt, H, y, self._noise_sd(dt[:, None], uncertainty), errors)

    def _take(self, sample: Sample) -> None:
        dt = min(sample.t - self._history[-1].t, 1.0) if self._history else 1.0
        tau, derivative = self._model.linearise(sample, self._x)
        noise_sd = self._noise_sd(dt, self._model.direction_uncertainty(sample.v))
        H, y = derivative @ self._unwhiten, sample.tau - tau + derivative @ (self._x - self._mean)
        noise_sd, surprise = self._bank.held_back(dt, H, y, noise_sd)
        self._samples += 1
        self._rejected += int(surprise > 2 * GATE)
        self._bank.update(dt, H, y, noise_sd, self._errors[-1] if self._errors else None)
        if self._samples % 5 == 0:
            self._x = self._plausible()

    def _noise_sd(
        self, dt: float | Float[np.ndarray, "sample 1"], uncertainty: Float[np.ndarray, "*sample joint"]
    ) -> Float[np.ndarray, "*sample joint"]:
        """Noise of samples `dt` after those before them [s], with this uncertainty of the direction of motion [N·m]."""
        # Correlated residuals carry less information: the variance grows by the number of samples per correlation time.
        repeats = np.maximum(self._noise.correlation_s / dt, 1.0)
        return np.hypot(self._noise.sd * np.sqrt(repeats), uncertainty)

    def parameters(self) -> Parameters:
        """Return the parameters of `estimate`; without their covariance this takes a tenth of the time."""
        x = self._mean + self._unwhiten @ self._bank.mean()
        return (x if self._project.is_physical(x) else self._project(x, self.covariance()))[: self._told]

    def estimate(self) -> Estimate:
        """Return the estimate, with bodies projected onto physically possible ones."""
        covariance = self.covariance()
        x = self._project(self._mean + self._unwhiten @ self._bank.mean(), covariance)
        scale = self._restlessness()
        told, rejected = slice(0, self._told), self._rejected / max(self._samples, 1)
        return Estimate(self._t, x[told], covariance[told, told], rejected, scale)

    def _choose_rows(self, asked: bool) -> None:
        """Take rows along the requested motion if `asked` and the model can; otherwise along the measured motion."""
        if isinstance(self._model, Instrumented):
            self._model.is_on = asked

    def _restlessness(self) -> float:
        """Size of the slow disturbance over its expected size [-]."""
        return float(self._bank.weights @ self._scales)

    def _plausible(self) -> Parameters:
        """Point of linearisation: the mean, limited to `PLAUSIBLE_SD` because a few early samples can be misleading."""
        return self._mean + self._unwhiten @ np.clip(self._bank.mean(), -PLAUSIBLE_SD, PLAUSIBLE_SD)

    def _plausible_scales(self) -> Float[np.ndarray, " scale"]:
        """Sizes of the disturbance for which a filter runs: the likely ones, and the neighbours of the best.

        The neighbours are kept because a wearer may become restless later.
        """
        weights = self._bank.weights
        likely = self._scales[weights > UNLIKELY]
        best = int(np.searchsorted(DISTURBANCE_SCALES, self._scales[int(weights.argmax())]))
        around = DISTURBANCE_SCALES[max(best - 1, 0) : best + 2]
        return np.union1d(likely, around)

    def _empty_bank(self, considers: bool = True) -> FilterBank:
        considered = self._discrepancy.count_of_joint if considers and self._discrepancy is not None else 0
        disturbance = self._scales[:, None] * self._noise.disturbance_sd
        return FilterBank(self._free, disturbance, self._noise.disturbance_correlation_s, considered)

    def covariance(self) -> Covariance:
        """Covariance of all parameters, hidden ones included."""
        return self._unwhiten @ self._bank.covariance() @ self._unwhiten.T
