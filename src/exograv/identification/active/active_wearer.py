"""Identification of an arm from repeated touches of a wearer who works.

The muscle torque is an unknown input with as many components as there are measured torques. Nothing but what is assumed
about it (`muscle_torque`) separates it from the weight of the arm. docs/explanation/active_wearer.md states the bound.

Only the mean over the touches enters. Differences between touches are caused by the muscles themselves: a stronger push
accelerates the arm more. A fit to these differences takes the muscles' torque for inertia and weight that are missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import block_diag, cho_solve, cholesky, solve_triangular

from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.setting import Setting
from exograv.identification.core.square_root import square_root
from exograv.identification.methods import with_hidden

from .muscle_torque import MuscleTorque, repeated_correlation, touch_phase, varying_correlation

BINS = 24
"""Number of phases of a touch over which samples are averaged [-]: 0.11 s of 2.75 s each."""

LINEARISATIONS = 3
"""Gauss–Newton steps from the prior."""

PLAUSIBLE_SD = 2.5
"""Largest distance from the prior at which the model is linearised [standard deviations]."""

CONTACT_S = (0.15, 0.4)
"""Time before and after a touch in which the finger may push against the screen [s]. These samples are not used."""

STANDSTILL_V = 0.15
"""Speed below which friction may hide the torque of a joint [rad/s]. A joint of a working wearer may stick for minutes,
with the same error in all of its samples. These samples are not used."""

Each = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class TouchWindow:
    """Window of the task, as the estimator needs it."""

    samples: Sequence[Sample]
    """Averaged samples while the window is open; `t` is on the same clock as the touches."""

    touches: Sequence[float]
    """Times of the touches [s]."""

    condition: str = ""
    """Condition that the machine made on purpose, such as its level of support. Windows of the same condition are
    averaged."""


@dataclass(frozen=True)
class _Mean:
    """Mean equations of one joint over all touches of one condition."""

    condition: str
    phase: Float[np.ndarray, " bin"]
    H: Float[np.ndarray, "bin unknown"]
    y: Float[np.ndarray, " bin"]
    noise_variance: Float[np.ndarray, " bin"]
    varying_variance: float
    """Variance between touches [(N·m)²]."""
    touches: int


class ActiveWearer:
    """Batch estimator from windows of touches. Its prior is that of all methods."""

    name = "active"

    def __init__(self, setting: Setting, muscle: MuscleTorque | None = None):
        """Start from the prior of `setting`; the method takes ownership of its model."""
        self._muscle, self._noise, self._discrepancy = muscle or MuscleTorque(), setting.noise, setting.discrepancy
        self._model, hidden = with_hidden(setting.model, setting)
        hidden_sd = np.zeros(0) if hidden is None else hidden.sd
        self._told = len(setting.mean)
        self._mean = np.append(setting.mean, np.zeros(len(hidden_sd)))
        self._unwhiten = np.asarray(block_diag(square_root(setting.covariance), np.diag(hidden_sd)))
        self._free = self._unwhiten.shape[1]
        self._project = PhysicalProjection(setting.bodies, setting.mean)
        self._windows: list[TouchWindow] = []

    def add(self, window: TouchWindow) -> None:
        """Take the samples of one window."""
        self._windows.append(window)

    def estimate(self) -> Estimate:
        """Return the estimate from all windows up to now; the start if there is none."""
        x, mean, covariance = self._mean.copy(), np.zeros(self._free), np.eye(self._free)
        for _ in range(LINEARISATIONS if self._windows else 0):
            mean, covariance = self._solved(self._means(x), self._muscle)
            x = self._mean + self._unwhiten @ np.clip(mean, -PLAUSIBLE_SD, PLAUSIBLE_SD)
        P = self._unwhiten @ covariance @ self._unwhiten.T
        x = self._project(self._mean + self._unwhiten @ mean, P)
        told, seconds = slice(0, self._told), sum((_duration_s(window) for window in self._windows), 0.0)
        return Estimate(seconds, x[told], P[told, told], 0.0, 1.0)

    def bounds(self, muscles: Sequence[MuscleTorque], varying_Nm: float | None = None) -> list[Covariance]:
        """Smallest covariance of the parameters under each assumption about the muscles (Cramér–Rao, with the prior).

        Args:
            muscles: Assumptions about the muscle torque.
            varying_Nm: Standard deviation of the torque between touches [N·m]; as measured if None.
        """
        means, told = self._means(self._mean.copy()), slice(0, self._told)
        found = [self._solved(means, muscle, varying_Nm)[1] for muscle in muscles]
        return [(self._unwhiten @ one @ self._unwhiten.T)[told, told] for one in found]

    def _solved(
        self, means: Sequence[_Mean], muscle: MuscleTorque, varying_Nm: float | None = None
    ) -> tuple[Float[np.ndarray, " unknown"], Float[np.ndarray, "unknown unknown"]]:
        """Mean and covariance of the whitened unknowns, without the discrepancy."""
        unknowns = means[0].H.shape[1]
        information, right, usual_s = np.eye(unknowns), np.zeros(unknowns), _usual_s(self._windows)
        joints = len(self._noise.sd)
        for j in range(joints):
            rows = [one for one in means[j::joints] if len(one.phase)]
            if not rows:
                continue
            lower = cholesky(_covariance(rows, muscle, usual_s, varying_Nm), lower=True)
            H, y = np.vstack([one.H for one in rows]), np.concatenate([one.y for one in rows])
            white = solve_triangular(lower, np.column_stack([H, y]), lower=True)
            information += white[:, :-1].T @ white[:, :-1]
            right += white[:, :-1].T @ white[:, -1]
        root = cholesky(information, lower=True)
        mean, covariance = cho_solve((root, True), right), cho_solve((root, True), np.eye(unknowns))
        return mean[: self._free], covariance[: self._free, : self._free]

    def _means(self, x: Parameters) -> list[_Mean]:
        """Return mean equations, linearised at `x`: all joints of the first condition, then of the next one."""
        usual_s = _usual_s(self._windows)
        parts: dict[str, list[tuple[np.ndarray, ...]]] = {}
        self._model.restart()
        for window in self._windows:
            t = np.array([sample.t for sample in window.samples])
            phase, H, y, uncertain = touch_phase(t, window.touches, usual_s), *self._rows(window, x)
            v = np.array([sample.v for sample in window.samples])
            usable = (np.abs(v) >= STANDSTILL_V) & _closed(H)[:, None] & ~_in_contact(t, window.touches)[:, None]
            parts.setdefault(window.condition, []).append((phase, H, y, uncertain, usable))
        touches = {
            name: sum(len(window.touches) for window in self._windows if window.condition == name) for name in parts
        }
        return [
            self._averaged(name, j, [np.concatenate(column) for column in zip(*rows, strict=True)], touches[name])
            for name, rows in parts.items()
            for j in range(len(self._noise.sd))
        ]

    def _averaged(self, condition: str, joint: int, columns: list[np.ndarray], touches: int) -> _Mean:
        phase, H, y, uncertain, usable = columns
        rows = usable[:, joint]
        phase, H, y, uncertain = phase[rows], H[rows, joint], y[rows, joint], uncertain[rows, joint]
        at = np.minimum((BINS * phase).astype(int), BINS - 1)
        groups = [np.flatnonzero(at == k) for k in range(BINS)]
        groups = [group for group in groups if len(group) > 1]
        own = float(self._noise.sd[joint]) ** 2
        return _Mean(
            condition,
            np.array([phase[group].mean() for group in groups]),
            np.array([H[group].mean(axis=0) for group in groups]).reshape(len(groups), H.shape[1]),
            np.array([y[group].mean() for group in groups]),
            np.array([own / len(group) + float((uncertain[group] ** 2).mean()) / len(group) for group in groups]),
            float(np.mean([y[group].var() for group in groups])) if groups else 0.0,
            max(touches, 1),
        )

    def _rows(self, window: TouchWindow, x: Parameters) -> tuple[np.ndarray, Each, Each]:
        """Return rows of the unknowns with the discrepancy, torque beyond the prior's, and uncertainty of friction."""
        samples, model = window.samples, self._model
        found = [(*model.linearise(sample, x), model.direction_uncertainty(sample.v)) for sample in samples]
        tau, derivative, uncertain = (np.array(column) for column in zip(*found, strict=True))
        H = (derivative.reshape(-1, len(x)) @ self._unwhiten).reshape(*tau.shape, -1)
        y = np.array([sample.tau for sample in samples]) - tau + derivative @ (x - self._mean)
        if self._discrepancy is None:
            return H, y, uncertain
        # Without a closed posture the rows stay zero.
        fields = np.array([self._discrepancy.errors(sample.q, sample.v) for sample in samples])
        return np.concatenate([H, fields * _closed(H)[:, None, None]], axis=-1), y, uncertain


def _covariance(
    rows: Sequence[_Mean], muscle: MuscleTorque, usual_s: float, varying_Nm: float | None
) -> Float[np.ndarray, "bin bin"]:
    """Covariance of one joint's mean equations: muscle torque and noise."""
    phase = np.concatenate([one.phase for one in rows])
    repeated = repeated_correlation(phase)
    varying = [
        (one.varying_variance if varying_Nm is None else varying_Nm**2)
        / one.touches
        * varying_correlation(one.phase, usual_s)
        for one in rows
    ]
    own = block_diag(*(np.ones((len(one.phase), len(one.phase))) for one in rows))
    noise = np.concatenate([one.noise_variance for one in rows])
    answer_Nm = muscle.answer_Nm if len(rows) > 1 else 0.0
    together = repeated * (muscle.repeated_Nm**2 + answer_Nm**2 * own)
    return together + np.asarray(block_diag(*varying)) + np.diag(noise)


def _closed(H: Float[np.ndarray, "sample joint unknown"]) -> Bool[np.ndarray, " sample"]:
    """Mark samples in which the model found a posture of the arm; it returns zeros otherwise."""
    return np.abs(H).max(axis=(1, 2)) > 0.0


def _duration_s(window: TouchWindow) -> float:
    return window.samples[-1].t - window.samples[0].t if window.samples else 0.0


def _usual_s(windows: Sequence[TouchWindow]) -> float:
    """Median time from touch to touch [s]."""
    gaps = np.concatenate([np.diff(np.array(window.touches)) for window in windows])
    return float(np.median(gaps)) if len(gaps) else 1.0


def _in_contact(t: np.ndarray, touches: Sequence[float]) -> np.ndarray:
    before, after = CONTACT_S
    return np.array([any(touch - before <= at <= touch + after for touch in touches) for at in t])
