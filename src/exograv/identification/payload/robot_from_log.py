"""Identification of an unloaded robot from its logs: links, rotors and friction, as in stage 0 of an exoskeleton.

There are no known weights here, so the user states the torque per current. The links that several joints carry show how
far the stated gains contradict each other; an error that all gains share stays unknown.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S
from exograv.identification.core.arm_model import SLOW_V
from exograv.identification.core.correlation import integrated_correlation
from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Covariance, Joints, Parameters, Sample
from exograv.identification.core.sample_pace import Averages

from .payload import PayloadModel
from .robot_prior import Spread, changing, robot_prior, with_changes

ROUNDS, ITERATIONS = 5, 8
SETTLED = 0.01  # largest last step, in standard deviations
NOISE_SD_START = 0.02  # of the effort; the first round replaces it
FOLDS = 5  # parts of each log that are held out, one after the other
CLEAR_SAMPLES_MIN = 50
FIELD_SHARES = (0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
"""Possible sizes of the part that repeats with the posture, as shares of the residual [-]; all are equally likely."""
LOAD_FIELDS = (0.0, 0.0025, 0.005, 0.01, 0.02, 0.04)
"""Possible sizes of the part in proportion to the load [-]; the gain of a drive changes by up to some hundredths with
its angle."""
FELT_EVERY = 20  # samples
FELT_MIN = 0.03  # RMS torque per standard deviation, as a share of the residual


@dataclass(frozen=True)
class Residuals:
    """Statistics of the residual torque of parts of the unloaded logs that were held out of the fit."""

    sd: Joints
    """Standard deviation in clear motion [N·m]."""

    correlation_s: Joints
    """Integrated autocorrelation time [s]."""

    field_sd: Joints
    """Size of the part that repeats with the posture [N·m]."""

    per_load: float
    """Size of the part that repeats with the posture and is in proportion to the load of the joint [-]."""


@dataclass(frozen=True)
class RobotFromLog:
    """Parameters of a robot, identified from its unloaded logs."""

    x: Parameters
    """All parameters in the order of `RobotBlocks`; the payload's are zero."""

    covariance: Covariance
    """Covariance of `x`, with friction as it may be in another log; zero for the payload's entries."""

    residuals: Residuals

    spread: Spread
    """Sizes of gain errors and of changes of friction that agree with the logs."""

    @property
    def residual_sd(self) -> Joints:
        """Standard deviation of the held-out residual torque in clear motion [N·m]."""
        return self.residuals.sd

    @property
    def correlation_s(self) -> Joints:
        """Integrated autocorrelation time of that residual [s]."""
        return self.residuals.correlation_s


def robot_from_log(model: PayloadModel, *logs: list[Sample]) -> RobotFromLog:
    """Fit the robot to unloaded motions: Gauss–Newton, maximum a posteriori, with the current as output.

    Links, rotors, gains and friction are the same in all logs; each log has its own change of the friction. Each round
    weights the samples by size and correlation of the previous round's held-out residuals.
    """
    fit = _Fit(model, [thinned(samples) for samples in logs])
    found = fit.start()
    for _ in range(ROUNDS):
        found = fit.optimum(found)
        found = replace(found, residuals=fit.held_out(found), spread=fit.spread(found))
    shared = fit.shared
    x = np.zeros(model.n_parameters)
    x[model.blocks.robot] = found.z[:shared]
    covariance = np.zeros((len(x), len(x)))
    covariance[model.blocks.robot, model.blocks.robot] = found.covariance[:shared, :shared]
    covariance = with_changes(covariance, found.spread, x, model.n_joints)
    return RobotFromLog(x, covariance, found.residuals, found.spread)


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
    # A gain error scales the payload's torque, which this motion's robot torque alone does not show.
    gain = np.abs(root[model.blocks.gain] @ directions.T).max(axis=0) > FELT_MIN * np.min(robot.spread.gain)
    kept = root @ directions[(strength > FELT_MIN * np.sqrt(len(felt))) | gain].T
    return kept @ kept.T


@dataclass(frozen=True)
class _Found:
    """State of the fit: unknowns z (robot, then the changes of each log), and their weights."""

    z: Float[np.ndarray, " unknown"]
    covariance: Float[np.ndarray, "unknown unknown"]
    residuals: Residuals
    spread: Spread


@dataclass(frozen=True)
class _Rows:
    """Residual torque, derivative and load of one log at the present robot."""

    residual: Float[np.ndarray, "sample joint"]
    H: Float[np.ndarray, "sample joint unknown"]
    direction_sd: Float[np.ndarray, "sample joint"]


class _Fit:
    """Weighted least-squares fit of several logs, with the description as prior."""

    def __init__(self, model: PayloadModel, logs: list[list[Sample]]):
        self._model, self._logs, self._n = model, logs, model.n_joints
        self._mean, self._sd = robot_prior(model.tree)
        self._changing = changing(self._n)
        self._unit_field = Discrepancy(np.ones(self._n), POSTURE_LENGTH_RAD, FEATURES)
        self.shared = len(self._mean)
        """Number of unknowns that all logs share."""

    def start(self) -> _Found:
        """Return the prior, with a guess of the noise."""
        noise = NOISE_SD_START * np.array([joint.effort for joint in self._model.tree.joints])
        residuals = Residuals(noise, np.full(self._n, SAMPLE_PERIOD_S), noise, 0.0)
        z = np.concatenate([self._mean, np.zeros(len(self._changing) * len(self._logs))])
        return _Found(z, np.zeros((len(z), len(z))), residuals, Spread())

    def optimum(self, found: _Found) -> _Found:
        """Unknowns and covariance, iterated from the present ones."""
        z, prior_sd = found.z, self._prior_sd(found)
        mean, covariance = np.zeros_like(z), found.covariance
        mean[: self.shared] = self._mean
        for _ in range(ITERATIONS):
            information, slope = np.diag(prior_sd**-2.0), prior_sd**-2.0 * (mean - z)
            for rows in self._all_rows(z):
                more, right = _information(rows, self._weight(rows, found))
                information += more
                slope += right
            covariance = np.linalg.inv(information)
            step = covariance @ slope
            z = z + step
            if np.all(np.abs(step) <= SETTLED * np.sqrt(np.diag(covariance))):
                break
        return replace(found, z=z, covariance=covariance)

    def held_out(self, found: _Found) -> Residuals:
        """Statistics of the residual of each part of the logs, predicted from all other parts."""
        errors, loads, clear, features = [], [], [], []
        for k, rows in enumerate(self._all_rows(found.z)):
            weight = self._weight(rows, found)
            robot = self._robot_of(found.z, k)
            for part in np.array_split(np.arange(len(rows.residual)), FOLDS):
                inside = _Rows(rows.residual[part], rows.H[part], rows.direction_sd[part])
                more, right = _information(inside, weight[part])
                # Without this part the optimum moves by −(Λ − ΔΛ)⁻¹ Δr, to first order.
                moved = np.linalg.solve(np.eye(len(found.z)) - found.covariance @ more, found.covariance @ right)
                errors.append(inside.residual + inside.H @ moved)
            loads += [self._load(sample, robot) for sample in self._logs[k]]
            clear += [np.abs(sample.v) > SLOW_V for sample in self._logs[k]]
            features += [self._unit_field.errors_of_joint(sample.q, sample.v) for sample in self._logs[k]]
        sd, correlation_s = _statistics(errors, np.array(clear), self._period_s())
        kept = _Kept(np.concatenate(errors), np.array(clear), np.array(loads), np.array(features))
        repeats = np.maximum(correlation_s / SAMPLE_PERIOD_S, 1.0)
        return Residuals(sd, correlation_s, *_fields(kept, sd, repeats))

    def spread(self, found: _Found) -> Spread:
        """Sizes of gain errors and changes that agree with the present unknowns."""
        blocks, variance = self._model.blocks, np.diag(found.covariance)
        gain = slice(blocks.gain.start - blocks.robot.start, blocks.gain.stop - blocks.robot.start)
        changes = (found.z[self.shared :], variance[self.shared :])
        by_log = tuple(values.reshape(len(self._logs), -1) for values in changes)
        x = self._robot_of(found.z, None)
        return found.spread.corrected((found.z[gain], variance[gain]), (by_log[0], by_log[1]), x)

    def _prior_sd(self, found: _Found) -> Float[np.ndarray, " unknown"]:
        sd, blocks = self._sd.copy(), self._model.blocks
        sd[blocks.gain.start - blocks.robot.start : blocks.gain.stop - blocks.robot.start] = found.spread.gain
        changes = found.spread.changes(self._robot_of(found.z, None), self._n)
        # Before the first fit the friction is zero; a change of zero size would have no information matrix.
        least = 1e-3 * self._sd[self._changing - blocks.robot.start]
        return np.concatenate([sd, *[np.maximum(changes, least)] * len(self._logs)])

    def _robot_of(self, z: Float[np.ndarray, " unknown"], log: int | None) -> Parameters:
        """Parameters of the robot in one log, or without the changes of any log."""
        x = np.zeros(self._model.n_parameters)
        x[self._model.blocks.robot] = z[: self.shared]
        if log is not None:
            x[self._changing] += z[self._of_log(log)]
        return x

    def _of_log(self, log: int) -> slice:
        start = self.shared + log * len(self._changing)
        return slice(start, start + len(self._changing))

    def _all_rows(self, z: Float[np.ndarray, " unknown"]) -> list[_Rows]:
        return [self._rows(z, k) for k in range(len(self._logs))]

    def _rows(self, z: Float[np.ndarray, " unknown"], log: int) -> _Rows:
        model, samples, x = self._model, self._logs[log], self._robot_of(z, log)
        residual = np.empty((len(samples), self._n))
        H = np.zeros((*residual.shape, len(z)))
        direction = np.empty_like(residual)
        for i, sample in enumerate(samples):
            tau, derivative = model.linearise(sample, x)
            residual[i] = sample.tau - tau
            H[i, :, : self.shared] = derivative[:, model.blocks.robot]
            H[i, :, self._of_log(log)] = derivative[:, self._changing]
            direction[i] = model.direction_uncertainty(sample.v)
        return _Rows(residual, H, direction)

    def _weight(self, rows: _Rows, found: _Found) -> Float[np.ndarray, "sample joint"]:
        repeats = np.maximum(found.residuals.correlation_s / SAMPLE_PERIOD_S, 1.0)
        return 1.0 / np.hypot(found.residuals.sd * np.sqrt(repeats), rows.direction_sd)

    def _load(self, sample: Sample, robot: Parameters) -> Joints:
        still = Sample(0.0, sample.q, np.zeros(self._n), np.zeros(self._n), sample.tau)
        return self._model.linearise(still, robot)[0].copy()

    def _period_s(self) -> float:
        return self._logs[0][1].t - self._logs[0][0].t


def _information(
    rows: _Rows, weight: Float[np.ndarray, "sample joint"]
) -> tuple[Float[np.ndarray, "unknown unknown"], Float[np.ndarray, " unknown"]]:
    H = (rows.H * weight[..., None]).reshape(-1, rows.H.shape[-1])
    return H.T @ H, H.T @ (rows.residual * weight).ravel()


def _statistics(
    parts: list[Float[np.ndarray, "_ joint"]], clear: Bool[np.ndarray, "sample joint"], period_s: float
) -> tuple[Joints, Joints]:
    """Return standard deviation and correlation time of held-out residuals in clear motion, per joint."""
    columns = []
    starts = np.cumsum([0, *[len(part) for part in parts]])
    for j in range(clear.shape[1]):
        kept = clear[:, j] if np.count_nonzero(clear[:, j]) >= CLEAR_SAMPLES_MIN else np.ones(len(clear), dtype=bool)
        error = np.concatenate([part[:, j] for part in parts])
        # The correlation is taken within a part: at its border the prediction changes.
        inside = [part[kept[a:b], j] for part, a, b in zip(parts, starts[:-1], starts[1:], strict=True)]
        times = [integrated_correlation(r, period_s) for r in inside if len(r) > CLEAR_SAMPLES_MIN // FOLDS]
        columns.append((np.sqrt(np.mean(error[kept] ** 2)), float(np.mean(times)) if times else period_s))
    sd, correlation_s = np.array(columns).T
    return sd, correlation_s


@dataclass(frozen=True)
class _Kept:
    """Held-out residuals of all logs, and the quantities on which they may depend."""

    error: Float[np.ndarray, "sample joint"]
    clear: Bool[np.ndarray, "sample joint"]
    load: Float[np.ndarray, "sample joint"]
    features: Float[np.ndarray, "sample joint feature"]


def _fields(kept: _Kept, sd: Joints, repeats: Joints) -> tuple[Joints, float]:
    """Sizes of the posture's field per joint [N·m] and of the load's field [-], as root mean squares of the posterior.

    The residual is noise plus a field of the posture plus a field in proportion to the load. Each pair of sizes has the
    likelihood of the residuals, in the space of the fields' features. All joints share the size of the load's field.
    """
    likelihood = np.array([_likelihood(kept, j, float(sd[j]), float(repeats[j])) for j in range(len(sd))])
    by_load = np.exp(_normalised(_log_sum(likelihood, axis=1).sum(axis=0)))
    per_load = float(np.sqrt(by_load @ np.square(LOAD_FIELDS)))
    shares = np.exp(likelihood - _log_sum(likelihood, axis=1)[:, None, :])
    return sd * np.sqrt(np.einsum("jsl,l,s->j", shares, by_load, np.square(FIELD_SHARES))), per_load


def _likelihood(kept: _Kept, joint: int, sd: float, repeats: float) -> Float[np.ndarray, "share load"]:
    """Logarithm of the likelihood of one joint's residuals for each pair of sizes."""
    clear = kept.clear[:, joint]
    F = kept.features[clear, joint]
    G = kept.load[clear, joint][:, None] * F
    Q, R = np.linalg.qr(np.hstack([F, G]))
    seen, split = Q.T @ kept.error[clear, joint], F.shape[1]
    of_posture, of_load = R[:, :split] @ R[:, :split].T, R[:, split:] @ R[:, split:].T
    values = np.empty((len(FIELD_SHARES), len(LOAD_FIELDS)))
    for i, share in enumerate(FIELD_SHARES):
        for k, per_load in enumerate(LOAD_FIELDS):
            # Coloured noise has `repeats` times the white variance in smooth features.
            covariance = (share * sd) ** 2 * of_posture + per_load**2 * of_load
            covariance += np.eye(len(seen)) * repeats * sd**2 * max(1.0 - share**2, 0.05)
            factor = cho_factor(covariance, lower=True)
            determinant = np.log(np.diag(factor[0])).sum()
            values[i, k] = -0.5 * seen @ cho_solve(factor, seen) - determinant
    return values


def _log_sum(values: np.ndarray, axis: int) -> np.ndarray:
    return np.asarray(logsumexp(values, axis=axis))


def _normalised(values: np.ndarray) -> np.ndarray:
    return values - logsumexp(values)
