"""Watch over a session of hours: which slow change explains how the torque of the same motion differs from before?

The machine repeats one motion with the relaxed arm. Errors of the model that repeat with the posture cancel in the
difference of the two residual torques. What remains is what has changed, noise, and the wearer's slow torque.

Any set of few changes may have happened. The posterior probability of each set follows from its evidence, and a change
is told if the sets that contain it hold nearly all of the probability. Changes that share the probability cannot be
told apart.

Source: George & McCulloch 1997, Statistica Sinica 7:339 (choice among sets of variables with a conjugate prior).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Covariance, Parameters, Sample
from exograv.identification.core.left_over import TARGET_NM
from exograv.identification.core.prior import DISTURBANCE_SD
from exograv.identification.core.square_root import GATE
from exograv.model.assembly import Assembly
from exograv.model.loops import FIT

from .slow_causes import HAPPENS, USUAL_SIZE, effects, place_of, possible_causes
from .slow_change import Cause, FoundChange, Kind, SlowJudgement

TOGETHER = 3
"""Largest number of changes that may have happened at once."""

SURE, EXCLUDED = 0.95, 0.05
"""Probability from which a change is told, and below which it is excluded [-]."""

SCALES = (1.0, 2.0, 4.0)
"""Sizes of the wearer's slow torque over the assumed size that are compared [-]. None is smaller than usual: a calm
joint must not make the torque of another joint look like a change."""

CORRELATIONS_S = (1.0, 2.5, 5.0)
"""Correlation times of that torque that are compared [s]: 1-5 s in people (docs/explanation/arm.md). A short one hides
friction, a long one the torque of a wearer who pulls."""

UNREST = tuple(product(SCALES, CORRELATIONS_S))
"""All pairs of size and correlation time that are compared."""

CHANGED_SHARE = 0.5
"""Share of the model's discrepancy that may have changed between two motions [-]: tissue creeps, and its law differs
from that of the model. Assumed."""

MATTERS_SHARE = 0.5
"""Share of the left over's target from which the torque of a change, RMS over the motion, is worth a message [-]."""

REWEIGHTINGS = 2
"""Number of times that bursts lose weight."""

ONE_IN = 3
"""Divisor of the sample rate: one in so many means is compared [-]."""

NEGLIGIBLE = 1e-9
"""Weight of a set of changes below which it adds nothing to a size [-]."""

ENDS_SD = 1.96
"""Half width of a 95 % interval [standard deviations]."""

Joints = Float[np.ndarray, " joint"]
Column = Float[np.ndarray, " sample"]
Difference = Float[np.ndarray, "sample joint"]


class SlowWatch:
    """Watch over one arm, by repetitions of the motion of its identification."""

    def __init__(self, model: ArmModel, x: Parameters, covariance: Covariance, before: Sequence[Sample]):
        """Remember how the motion was before.

        Args:
            model: Model of this arm in this machine; the watch takes ownership.
            x: Parameters of the arm as identified.
            covariance: Covariance of `x`.
            before: Samples of the motion, from its first tick on.
        """
        machine = model.machine
        places = model.assembly.description.places
        self._noise_sd, self._repeats_s = np.asarray(machine.residual_sd), np.asarray(machine.correlation_s)
        self._slow_sd = np.array([DISTURBANCE_SD[place_of(freedom)] for freedom in model.assembly.arm.freedoms])
        self._discrepancy = Discrepancy.of_machine(CHANGED_SHARE * machine.residual_sd)
        self._matters_Nm = MATTERS_SHARE * np.array([TARGET_NM[place] for place in places])
        self._model, self._x = model, x
        layout = ParameterLayout.of(model.assembly)
        log_stiffness = layout.fit.start + FIT.index("cuff_log_stiffness")
        # The torque of a moved cuff is that of its way times its stiffness.
        self._way_sd = float(np.sqrt(covariance[log_stiffness, log_stiffness]))
        self.causes = possible_causes(model)
        """All changes that are considered."""
        self._before, self._before_t = effects(model, x, list(before)), np.array([sample.t for sample in before])

    def judge(self, samples: Sequence[Sample]) -> SlowJudgement:
        """Compare a repetition of the motion with the motion before; `samples` from its first tick on."""
        samples = samples[::ONE_IN]
        nowhere = np.zeros(len(self.causes))
        found = self._compared(samples, self._model, nowhere)
        slid = with_slid_cuffs(self._model.assembly, found)
        if slid is self._model.assembly:
            return found
        # The torque is not linear in the way of a cuff: the effects are taken again where the cuff seems to be.
        ways = {one.cause: one.size for one in found.changes if one.cause.kind is Kind.CUFF}
        at = np.array([ways.get(cause, 0.0) for cause in self.causes])
        return self._compared(samples, ArmModel(slid, self._model.machine), at)

    def _compared(self, samples: Sequence[Sample], model: ArmModel, ways: Float[np.ndarray, " cause"]) -> SlowJudgement:
        """Compare a repetition, with the effects of `model`, whose cuffs have moved by `ways` [m]."""
        now, t = effects(model, self._x, list(samples)), np.array([sample.t for sample in samples])
        at = np.minimum(np.searchsorted(self._before_t, t), len(self._before_t) - 1)
        at = np.where((at > 0) & (abs(self._before_t[at - 1] - t) < abs(self._before_t[at] - t)), at - 1, at)
        pairs = abs(self._before_t[at] - t) < np.diff(t).min()
        before = at[pairs]
        y = now.residual[pairs] - self._before.residual[before]
        for cause, way in zip(self.causes, ways, strict=True):
            y = y + way * now.by_size[pairs][:, :, cause.columns[0]]
        direction = np.hypot(now.direction_sd[pairs], self._before.direction_sd[before])
        errors = [self._discrepancy.errors_of_joint(samples[i].q, samples[i].v) for i in np.flatnonzero(pairs).tolist()]
        return self._judged(_Pairs(t[pairs], y, now.by_size[pairs], direction, np.array(errors)))

    def _judged(self, pairs: "_Pairs") -> SlowJudgement:
        sets = [chosen for n in range(TOGETHER + 1) for chosen in combinations(range(len(self.causes)), n)]
        repeats = np.maximum(self._repeats_s / np.diff(pairs.t).min(), 1.0)
        plain = np.hypot(np.sqrt(2.0 * repeats) * self._noise_sd, pairs.direction_sd)
        posterior = self._posterior(pairs, plain, sets)
        for _ in range(REWEIGHTINGS):
            off = np.abs(pairs.y - pairs.by_size @ posterior.mean)
            slow = posterior.scale * np.linalg.norm(self._tone_of(pairs.by_size), axis=2)
            # Noise enlarged until no burst exceeds the gate (Huber), as in the filter of the identification.
            noise_sd = np.sqrt(np.maximum(plain**2, (off / GATE) ** 2 - slow**2))
            posterior = self._posterior(pairs, noise_sd, sets)
        return self._told(posterior, np.sqrt(np.mean(pairs.by_size**2, axis=0)))

    def _tone_of(self, by_size: np.ndarray) -> Float[np.ndarray, "sample joint freedom"]:
        """Torque of the wearer's usual slow torque about each freedom of the arm, in both motions together [N·m]."""
        tone = [column for cause in self.causes if cause.kind is Kind.TONE for column in cause.columns]
        return np.sqrt(2.0) * self._slow_sd * by_size[:, :, tone]

    def _posterior(self, pairs: "_Pairs", noise_sd: Difference, sets: list[tuple[int, ...]]) -> "_Posterior":
        sd = np.array([USUAL_SIZE[cause.kind] for cause in self.causes for _ in cause.columns])
        happens = np.array([HAPPENS[cause.kind] for cause in self.causes])
        odds = np.log(happens) - np.log1p(-happens)
        samples, joints = pairs.y.shape
        rest = np.diag(noise_sd.ravel() ** 2)
        for j in range(joints):
            rest[j::joints, j::joints] += pairs.errors[:, j] @ pairs.errors[:, j].T
        tone = self._tone_of(pairs.by_size).reshape(samples * joints, -1)
        apart_s, together = np.abs(np.subtract.outer(pairs.t, pairs.t)), tone @ tone.T
        columns = np.column_stack([pairs.y.ravel(), pairs.by_size.reshape(samples * joints, -1) * sd])
        own = [[column for cause in chosen for column in self.causes[cause].columns] for chosen in sets]
        log_odds = np.array([odds[list(chosen)].sum() for chosen in sets])
        logs, fits = list[np.ndarray](), list[_Fit]()
        for scale, correlation_s in UNREST:
            slow = together * np.kron(np.exp(-apart_s / correlation_s), np.ones((joints, joints)))
            lower = np.linalg.cholesky(rest + scale**2 * slow)
            white = solve_triangular(lower, columns, lower=True)
            A, b = white[:, 1:].T @ white[:, 1:], white[:, 1:].T @ white[:, 0]
            constant = -0.5 * white[:, 0] @ white[:, 0] - np.log(np.diag(lower)).sum()
            found = _fits(own, A, b)
            logs.append(constant + np.array([fit.gain for fit in found]) + log_odds)
            fits += found
        weight = np.exp(np.concatenate(logs) - logsumexp(logs))
        return _Posterior(weight, fits, sets * len(UNREST), sd)

    def _told(self, posterior: "_Posterior", torque: Float[np.ndarray, "joint column"]) -> SlowJudgement:
        found = [self._found(posterior, number, torque) for number in range(len(self.causes))]
        sure = tuple(one for one in found if one.probability >= SURE and self._matters(one))
        open_ = sorted((one for one in found if EXCLUDED < one.probability < SURE), key=lambda one: -one.probability)
        # At least one of the open changes must be in nearly every set that is left.
        numbers = {self.causes.index(one.cause) for one in open_}
        share = sum(w for w, s in zip(posterior.weight, posterior.sets, strict=True) if numbers & set(s))
        one_of = tuple(open_) if share >= SURE and any(self._matters(one) for one in open_) else ()
        return SlowJudgement(sure, one_of, posterior.scale)

    def _matters(self, found: FoundChange) -> bool:
        return bool((found.torque_Nm >= self._matters_Nm).any())

    def _found(self, posterior: "_Posterior", number: int, torque: Float[np.ndarray, "joint column"]) -> FoundChange:
        cause = self.causes[number]
        size, half_width, probability = posterior.size_of(number, cause)
        if cause.kind is Kind.CUFF:
            half_width = float(np.hypot(half_width, ENDS_SD * self._way_sd * size))
        of_unit = np.linalg.norm(torque[:, list(cause.columns)], axis=1)
        return FoundChange(cause, size, half_width, probability, abs(size) * of_unit)


@dataclass(frozen=True)
class _Pairs:
    """Samples at the same place of both motions."""

    t: Column
    y: Difference
    """Residual torque now minus that before [N·m]."""
    by_size: np.ndarray
    """Torque per size of each column (sample, joint, column)."""
    direction_sd: Difference
    errors: np.ndarray
    """Errors of the model that may have changed (sample, joint, error) [N·m]."""


@dataclass(frozen=True)
class _Fit:
    """Sizes of one set of changes, over their usual sizes."""

    columns: list[int]
    mean: np.ndarray
    covariance: np.ndarray
    gain: float
    """Log evidence over no change."""


def with_slid_cuffs(assembly: Assembly, judgement: SlowJudgement) -> Assembly:
    """Return the assembly with the cuffs where a check has surely found them; the same one if none has moved."""
    ways = {found.cause.place: found.size for found in judgement.changes if found.cause.kind is Kind.CUFF}
    if not ways:
        return assembly
    before = assembly.slid_m or (0.0,) * len(assembly.cuffs)
    slid = (way + ways.get(cuff.name, 0.0) for way, cuff in zip(before, assembly.cuffs, strict=True))
    return replace(assembly, slid_m=tuple(slid))


def _fits(sets: Sequence[list[int]], A: np.ndarray, b: np.ndarray) -> list[_Fit]:
    """Fit the sizes of each set of changes, with a standard normal prior; sets of one size are fitted together."""
    fits: dict[int, _Fit] = {}
    for size in {len(columns) for columns in sets}:
        places = [place for place, columns in enumerate(sets) if len(columns) == size]
        columns = np.array([sets[place] for place in places], dtype=int)
        covariance = np.linalg.inv(A[columns[:, :, None], columns[:, None, :]] + np.eye(size))
        mean = np.einsum("sij,sj->si", covariance, b[columns])
        gain = 0.5 * np.einsum("si,si->s", b[columns], mean) + 0.5 * np.linalg.slogdet(covariance)[1]
        for i, place in enumerate(places):
            fits[place] = _Fit(sets[place], mean[i], covariance[i], float(gain[i]))
    return [fits[place] for place in range(len(sets))]


@dataclass(frozen=True)
class _Posterior:
    """Posterior of all sets of changes, at all sizes of the slow torque."""

    weight: np.ndarray
    fits: list[_Fit]
    sets: list[tuple[int, ...]]
    sd: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """Mean size of each column."""
        mean = np.zeros(len(self.sd))
        for weight, fit in zip(self.weight, self.fits, strict=True):
            mean[fit.columns] += weight * fit.mean
        return mean * self.sd

    @property
    def scale(self) -> float:
        """Mean size of the wearer's slow torque over the usual size [-]."""
        return float(self.weight.reshape(len(UNREST), -1).sum(axis=1) @ np.array([scale for scale, _ in UNREST]))

    def size_of(self, number: int, cause: Cause) -> tuple[float, float, float]:
        """Size of a change if it has happened, half width of its 95 % interval, and the probability that it has."""
        total, first, second = 0.0, np.zeros(len(cause.columns)), np.zeros((len(cause.columns), len(cause.columns)))
        for weight, chosen, fit in zip(self.weight, self.sets, self.fits, strict=True):
            if number not in chosen or weight < NEGLIGIBLE:
                continue
            at = [fit.columns.index(column) for column in cause.columns]
            total += weight
            first += weight * fit.mean[at]
            second += weight * (fit.covariance[np.ix_(at, at)] + np.outer(fit.mean[at], fit.mean[at]))
        if total == 0.0:
            return 0.0, 0.0, 0.0
        sd = self.sd[list(cause.columns)]
        mean = first / total * sd
        covariance = second / total * np.outer(sd, sd) - np.outer(mean, mean)
        if len(mean) == 1:
            return float(mean[0]), ENDS_SD * float(np.sqrt(covariance[0, 0])), float(total)
        size = float(np.linalg.norm(mean))
        along = mean / max(size, 1e-12)
        return size, ENDS_SD * float(np.sqrt(along @ covariance @ along)), float(total)
