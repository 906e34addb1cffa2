"""Recursive identification: a Bayesian information filter from the table's prior.

The filter estimates the slow torque of a restless wearer together with the parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.held_out import Residuals, agreement, nearest
from exograv.identification.core.hidden_cuffs import Slipping
from exograv.identification.core.instrument import Instrumented
from exograv.identification.core.interface import Agreement, Covariance, Estimate, Parameters, Sample, TorqueModel
from exograv.identification.core.misfit import USUAL_MISFIT, misfit
from exograv.identification.core.muscle_signals import with_slow_parts
from exograv.identification.core.noise import Noise
from exograv.identification.core.path_discrepancy import PathDiscrepancy
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.square_root import GATE, FilterBank, square_root
from exograv.identification.core.tissue import FIXED, Hidden

DISTURBANCE_SCALES = np.array([0.3, 0.6, 1.2, 2.4, 4.8, 9.6])
"""Multiples of `Noise.disturbance_sd` that the filter compares [-]."""

SIZES = ((0.2, 1.0), (0.03, 1.0))
"""Multiples of the prior of each group of hidden parameters that the filter compares [-]: tissue, cuffs."""

Postures = Float[np.ndarray, "posture joint"]

NOTHING_HIDDEN = Hidden(np.zeros(0), np.zeros(0, dtype=int))

USUAL_SCALES = DISTURBANCE_SCALES[:-1]
"""Multiples for decisions about the person [-]; the largest one would also explain the arm of another person."""

ASKED_ABOVE = 1.5
"""Multiple of `Noise.disturbance_sd` above which rows are taken along the requested motion [-]."""

UNLIKELY = 1e-6
"""Probability below which an assumed size is dropped at the next linearisation [-]."""

PLAUSIBLE_SD = 2.5
"""Largest distance from the prior for linearisation [standard deviations]; the estimate may be farther away."""

FIRST_GAP_S, GAP_MAX_S = 1.0, 60.0
"""Time before the first sample as the filter counts it, and longest time between two samples [s]."""

RELINEARISE_FIRST_S, RELINEARISE_GROWTH = 2.0, 1.6
"""First time of relinearisation of all samples [s], and the factor to each later time [-]."""


ASTRAY_SD = 4.0
"""Distance from the prior above which the estimate is checked by a second fit [standard deviations]. The first seconds
can lead the non-linear model to a wrong local minimum, where each step looks right."""

FRESH_STEPS = 4
"""Linearisations of the second fit, which starts from the prior."""

REWEIGHTINGS = 2
"""Number of times the samples are reweighted by their residuals, at each linearisation [-]."""


NEIGHBOURS = 16
"""Number of samples before the newest one from which the slow part of its muscle signals is taken [-]: 1.3 s."""

LEAST_FIT, LEAST_HELD_OUT = 100, 40
"""Least numbers of samples before and in a check [-]: 8 s and 3.2 s."""


@dataclass(frozen=True)
class _Linear:
    """Samples as linear measurements of the unknowns."""

    dt: Float[np.ndarray, " sample"]
    H: Float[np.ndarray, "sample joint unknown"]
    y: Float[np.ndarray, "sample joint"]
    noise_sd: Float[np.ndarray, "sample joint"]
    errors: Float[np.ndarray, "sample joint considered"] | None


@dataclass
class _Motion:
    """Samples of a motion, with the considered errors that depend on the motion alone."""

    discrepancy: Discrepancy | None
    path: PathDiscrepancy | None
    samples: list[Sample] = field(default_factory=list)
    errors: list[np.ndarray] = field(default_factory=list)
    """Torque of the discrepancy at each sample [N·m]."""
    displacements: list[np.ndarray] = field(default_factory=list)
    """Displacements of the shoulder's centre by the errors of its path at each sample [m]."""

    def take(self, sample: Sample) -> None:
        """Add the next sample of the motion."""
        self.samples.append(sample)
        if self.discrepancy is not None:
            self.errors.append(self.discrepancy.errors_of_joint(sample.q, sample.v))
        if self.path is not None:
            self.displacements.append(self.path.displacements(sample.q))

    def considered(
        self, derivative: Float[np.ndarray, "*sample joint parameter"], at: slice | int
    ) -> Float[np.ndarray, "*sample joint considered"] | None:
        """Torque of all considered errors of each joint at one or all samples [N·m]; None without any."""
        parts = [np.array(self.errors[at])] if self.errors else []
        if self.path is not None:
            parts.append(self.path.errors_of_joint(derivative, np.array(self.displacements[at])))
        return np.concatenate(parts, axis=-1) if parts else None


@dataclass(frozen=True)
class _Remembered:
    """Estimate before a check."""

    samples: int
    """Number of samples that it has used."""
    mean: Float[np.ndarray, " unknown"]
    covariance: Float[np.ndarray, "unknown unknown"]
    x: Parameters
    """Point of linearisation."""
    misfit: float
    """Size of the discrepancy over the expected one [-]."""
    postures: Postures
    """Postures of the check [rad]."""


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
        hidden: Hidden | None = None,
        path: PathDiscrepancy | None = None,
    ):
        """Start from the prior.

        Args:
            model: Torque model.
            mean: Prior mean of the parameters that an estimate contains.
            covariance: Prior covariance of these parameters.
            noise: Noise of the torque.
            bodies: Slices with the inertial parameters of the bodies.
            discrepancy: Model errors that repeat with the posture.
            hidden: Prior of further parameters of the model, which are learned but are not in an estimate.
            path: Errors of the path of the shoulder's centre.
        """
        self._told = len(mean)
        self._model, self._noise, self._discrepancy, self._path = model, noise, discrepancy, path
        hidden = hidden or NOTHING_HIDDEN
        self._mean = np.append(mean, np.zeros(len(hidden.sd)))
        self._unwhiten = np.asarray(block_diag(square_root(covariance), np.diag(hidden.sd)))
        self._free = self._unwhiten.shape[1]
        self._group = np.append(np.full(self._free - len(hidden.sd), FIXED), hidden.group)
        compared = [sizes if (hidden.group == group).any() else (1.0,) for group, sizes in enumerate(SIZES)]
        self._sizes = np.array(list(product(DISTURBANCE_SCALES, *compared)))
        self._bank = self._empty_bank(self._sizes)
        self._project = PhysicalProjection(bodies, mean)
        self._x = self._mean.copy()
        self._t = 0.0
        self._averages = Averages(BATCH_PERIOD_S)
        self._motion = _Motion(discrepancy, path)
        self._relinearise_t = RELINEARISE_FIRST_S
        self._misfit = USUAL_MISFIT
        """Size of the residual that repeats with the posture, over the expected discrepancy [-]."""
        self._samples = 0
        self._rejected = 0
        self._remembered: _Remembered | None = None
        self._choose_rows(False)

    def update(self, sample: Sample) -> None:
        """Take one sample. The filter uses means over 0.08 s."""
        self._t = sample.t
        kept = self._averages.take(sample)
        if kept is None:
            return
        self._motion.take(kept)
        self._take_newest()
        if sample.t >= self._relinearise_t:
            self.relinearise()
            self._relinearise_t *= RELINEARISE_GROWTH

    def relinearise(self) -> None:
        """Repeat the filter over all samples, linearised at the newest estimate: one Gauss–Newton step of the batch.

        This removes errors of early linearisations, for example at a shoulder position that was centimetres off. It
        takes some milliseconds per second of motion, five times as long if the estimate is checked by a second fit.
        Call it in a worker process, not in the loop.
        """
        if not self._motion.samples:
            return
        self._choose_rows(self._restlessness() > ASKED_ABOVE)
        self._step()
        if np.abs(self._bank.mean()).max() > ASTRAY_SD:
            self._doubt()

    def foresee(self, motion: Sequence[Sample], after: Sequence[int]) -> list[Covariance]:
        """Return the covariances that samples of a motion would leave, at the prior and with usual disturbances.

        The state of the method does not change. Hidden parameters have their full prior.

        Args:
            motion: Samples from the start of the motion; their torques have no effect.
            after: Numbers of samples, rising.

        Returns:
            Covariance of the parameters of an estimate after each of these numbers.
        """
        along = _Motion(self._discrepancy, self._path)
        for sample in motion:
            along.take(sample)
        linear, found, begin = self._linearised(along, self._mean), list[Covariance](), 0
        bank, rows = self._empty_bank(np.ones((1, self._sizes.shape[1]))), self._unwhiten[: self._told]
        for end in after:
            part = slice(begin, end)
            considered = None if linear.errors is None else linear.errors[part]
            bank.update_all(linear.dt[part], linear.H[part], 0.0 * linear.y[part], linear.noise_sd[part], considered)
            found.append(rows @ bank.covariance() @ rows.T)
            begin = end
        return found

    def hold_out(self, postures: Postures) -> None:
        """Remember the estimate up to now; the following samples, at `postures`, test it and are used as all others."""
        self.relinearise()
        covariance = self._bank.covariance(self._widened)
        self._remembered = _Remembered(
            len(self._motion.samples),
            self._bank.mean(),
            covariance,
            self._x.copy(),
            max(self._misfit, USUAL_MISFIT),
            postures,
        )

    def agreement(self) -> Agreement | None:
        """Test the remembered estimate by the samples since `hold_out`; None without enough of them.

        It takes as long as `relinearise`.
        """
        before = self._remembered
        if before is None or not LEAST_FIT < before.samples < len(self._motion.samples) - LEAST_HELD_OUT:
            return None
        linear, held = self._linearised(self._motion, before.x), slice(before.samples, None)
        residual = linear.y - linear.H @ before.mean
        noise_sd, _ = self._bank.all_held_back(linear.dt, residual, linear.noise_sd)
        visited = nearest(np.array([sample.q for sample in self._motion.samples[held]]), before.postures)
        H, errors = linear.H[held], None if linear.errors is None else before.misfit * linear.errors[held]
        joints = []
        for j, slow_sd in enumerate(self._noise.disturbance_sd):
            expected = H[:, j] @ before.covariance @ H[:, j].T
            if errors is not None:
                expected += errors[:, j] @ errors[:, j].T
            columns = linear.dt, residual[:, j], noise_sd[:, j]
            joints.append(Residuals(*columns, float(slow_sd), expected, visited))
        return agreement(joints)

    def _doubt(self) -> None:
        """Fit all samples again from the prior, and keep the fit with the larger evidence."""
        before = self._bank, self._x, self._sizes, self._rejected, self._misfit
        self._bank, self._x = self._empty_bank(self._sizes), self._mean.copy()
        for step in range(FRESH_STEPS):
            self._step(is_last=step == FRESH_STEPS - 1)
        if before[0].log_evidence > self._bank.log_evidence:
            self._bank, self._x, self._sizes, self._rejected, self._misfit = before

    def _step(self, is_last: bool = True) -> None:
        """Make one Gauss–Newton step over all samples, with bursts downweighted.

        The considered errors do not change the mean, so only the last pass of the last step carries them.
        """
        self._sizes = self._plausible_sizes()
        linear, likely = self._linearised(self._motion, self._x.copy()), self._bank
        noise_sd, surprise = linear.noise_sd, np.zeros(len(self._motion.samples))
        for reweighting in range(REWEIGHTINGS):
            residual = linear.y - linear.H @ likely.mean()
            noise_sd, surprise = likely.all_held_back(linear.dt, residual, linear.noise_sd)
            considers = is_last and reweighting == REWEIGHTINGS - 1
            likely = self._empty_bank(self._sizes, considers)
            likely.update_all(linear.dt, linear.H, linear.y, noise_sd, linear.errors if considers else None)
        self._bank = likely
        self._samples, self._rejected = len(surprise), int((surprise > 2 * GATE).sum())
        self._x = self._plausible()
        if is_last and linear.errors is not None:
            self._misfit = self._misfit_of(linear, linear.errors, noise_sd)

    def _misfit_of(
        self,
        linear: "_Linear",
        errors: Float[np.ndarray, "sample joint considered"],
        noise_sd: Float[np.ndarray, "sample joint"],
    ) -> float:
        """Size of the residual that repeats with the posture, at the likeliest sizes of disturbance and tissue."""
        scale, *sizes = self._sizes[int(self._bank.weights.argmax())]
        keep = np.exp(-linear.dt / self._noise.disturbance_correlation_s)
        H = linear.H * np.append(sizes, 1.0)[self._group]
        return misfit(keep, H, linear.y, errors, noise_sd, scale * self._noise.disturbance_sd)

    def _linearised(self, motion: _Motion, x: Parameters) -> "_Linear":
        """Return all samples of a motion, linearised at `x`."""
        history, model = with_slow_parts(motion.samples), self._model
        model.restart()
        rows = [(*model.linearise(sample, x), model.direction_uncertainty(sample.v)) for sample in history]
        tau, derivative, uncertainty = (np.array(column) for column in zip(*rows, strict=True))
        t, measured = np.array([sample.t for sample in history]), np.array([sample.tau for sample in history])
        dt = np.minimum(np.diff(t, prepend=t[0] - FIRST_GAP_S), GAP_MAX_S)
        flat = derivative.reshape(-1, len(x))
        H = (flat @ self._unwhiten).reshape(*tau.shape, -1)
        y = measured - tau + (flat @ (x - self._mean)).reshape(tau.shape)
        errors = motion.considered(derivative, slice(None))
        return _Linear(dt, H, y, self._noise_sd(dt[:, None], uncertainty), errors)

    def _take_newest(self) -> None:
        *before, sample = self._motion.samples[-1 - NEIGHBOURS :]
        dt = min(sample.t - before[-1].t, GAP_MAX_S) if before else FIRST_GAP_S
        newest = with_slow_parts([*before, sample])[-1]
        tau, derivative = self._model.linearise(newest, self._x)
        noise_sd = self._noise_sd(dt, self._model.direction_uncertainty(sample.v))
        H, y = derivative @ self._unwhiten, sample.tau - tau + derivative @ (self._x - self._mean)
        noise_sd, surprise = self._bank.held_back(dt, H, y, noise_sd)
        self._samples += 1
        self._rejected += int(surprise > 2 * GATE)
        self._bank.update(dt, H, y, noise_sd, self._motion.considered(derivative, -1))
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
        slipped = self._model.slipped(x) if isinstance(self._model, Slipping) else None
        return Estimate(self._t, x[told], covariance[told, told], rejected, scale, slipped)

    def _choose_rows(self, asked: bool) -> None:
        """Take rows along the requested motion if `asked` and the model can; otherwise along the measured motion."""
        if isinstance(self._model, Instrumented):
            self._model.is_on = asked

    def _restlessness(self) -> float:
        """Size of the slow disturbance over its expected size [-]."""
        return float(self._bank.weights @ self._sizes[:, 0])

    def _plausible(self) -> Parameters:
        """Point of linearisation: the mean, limited to `PLAUSIBLE_SD` because a few early samples can be misleading."""
        return self._mean + self._unwhiten @ np.clip(self._bank.mean(), -PLAUSIBLE_SD, PLAUSIBLE_SD)

    def _plausible_sizes(self) -> Float[np.ndarray, "filter size"]:
        """Disturbance scales and hidden sizes for which a filter runs: the likely ones, and neighbours.

        Neighbours of the best pair are kept in each direction: a wearer may become restless later, and the first
        seconds may not show what the tissue does.
        """
        weights = self._bank.weights
        best = self._sizes[int(weights.argmax())]
        at = int(np.searchsorted(DISTURBANCE_SCALES, best[0]))
        around = [self._sizes[weights > UNLIKELY], np.tile(best, (2, 1))]
        around[-1][:, 0] = DISTURBANCE_SCALES[[max(at - 1, 0), min(at + 1, len(DISTURBANCE_SCALES) - 1)]]
        for group, sizes in enumerate(SIZES):
            if (self._group == group).any():
                around.append(np.tile(best, (len(sizes), 1)))
                around[-1][:, 1 + group] = sizes
        return np.unique(np.vstack(around), axis=0)

    def _empty_bank(self, of_sizes: Float[np.ndarray, "filter size"], considers: bool = True) -> FilterBank:
        sources = (self._discrepancy, self._path) if considers else ()
        considered = sum(source.count_of_joint for source in sources if source is not None)
        disturbance = of_sizes[:, :1] * self._noise.disturbance_sd
        # `FIXED` is the last index.
        prior_sd = np.column_stack([of_sizes[:, 1:], np.ones(len(of_sizes))])[:, self._group]
        return FilterBank(self._free, disturbance, self._noise.disturbance_correlation_s, considered, prior_sd)

    def covariance(self) -> Covariance:
        """Covariance of all parameters, hidden ones included."""
        return self._unwhiten @ self._bank.covariance(self._widened) @ self._unwhiten.T

    @property
    def _widened(self) -> float:
        """Size of the considered errors over the expected one [-]."""
        return max(self._misfit / USUAL_MISFIT, 1.0)
