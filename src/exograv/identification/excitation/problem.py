"""The motion that tells most, as an optimisation: a figure of merit and limits, by the coefficients of a basis."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.identification.arm_model import ArmModel
from exograv.identification.interface import Parameters

from .basis import Basis, Coefficients
from .information import Criterion, Seen, Statistics
from .limits import MotionLimits
from .regressor import Along, along

SAMPLES = 80
"""Of one period: 0.25 s of 20, three within the shortest thing that moves."""

GRID_PER_HARMONIC = 16
"""Points at which speed and posture are held per harmonic: the motion between them exceeds by 2 % at most."""

ARM_EVERY = 2
"""Comfort and torque are held at every so many-th sample; they change slowly."""

Vector = Float[np.ndarray, " coefficient"]


@dataclass(frozen=True)
class Problem:
    """What is asked of a motion."""

    basis: Basis
    limits: MotionLimits
    model: ArmModel
    x: Parameters
    """Where the model is linearised."""
    statistics: Statistics
    criterion: Criterion
    passes: Sequence[float]
    """After how many periods the figure of merit is taken; the mean of all counts."""
    start_posture: Float[np.ndarray, " joint"] | None = None
    """Coefficients of the first shape where they are given: where a piece starts and ends [rad]."""
    samples: int = SAMPLES

    @property
    def shape(self) -> tuple[int, int]:
        """Of the coefficients."""
        return self.basis.mixing.shape[1], self.model.n_joints

    @property
    def dt(self) -> float:
        """Between samples [s]."""
        return self.basis.period_s / self.samples

    def grid(self) -> tuple[list[Float[np.ndarray, "point shape"]], float]:
        """Shapes with two derivatives where limits are held, and how far the motion may exceed between."""
        points = GRID_PER_HARMONIC * self.basis.harmonics
        tables = self.basis.tables(np.arange(points) * self.basis.period_s / points)
        return list(tables), self.basis.overshoot(points)

    def follow(self, coefficients: Coefficients, *, slopes: bool) -> Along:
        """The motion as the model sees it."""
        q, v, a = (table @ coefficients for table in self._tables())
        return along(self.model, self.x, q, v, a, slopes=slopes)

    def value(self, coefficients: Coefficients, seen: Along | None = None) -> float:
        """The figure of merit."""
        seen = self.follow(coefficients, slopes=False) if seen is None else seen
        return float(np.mean([self._seen(coefficients, seen).merit(passes)[0] for passes in self.passes]))

    def slope(self, coefficients: Coefficients, seen: Along) -> tuple[float, Coefficients]:
        """The figure of merit and its slope by the coefficients."""
        tables = self._tables()
        n, total, by_motion = self.model.n_joints, 0.0, np.zeros((self.samples, 3, self.model.n_joints))
        for passes in self.passes:
            value, by = self._seen(coefficients, seen).merit(passes)
            local = np.einsum("sdjp,sjp->sd", seen.H_by, by.H, optimize=True).reshape(-1, 3, n)
            local[:, 0] += by.q
            local[:, 1] += by.direction_sd * seen.direction_sd_by_v
            total, by_motion = total + value / len(self.passes), by_motion + local / len(self.passes)
        return total, sum((table.T @ by_motion[:, k] for k, table in enumerate(tables)), np.zeros(self.shape))

    def keeps_limits(self, coefficients: Coefficients) -> bool:
        """Whether machine and person stay within their limits, also between samples."""
        tables, overshoot = self.grid()
        middle = 0.5 * (self.limits.lower + self.limits.upper)
        q, v, a = (table @ coefficients for table in tables)
        if self.limits.broken_by_motion(middle + (q - middle) * overshoot, v * overshoot, a * overshoot).any():
            return False
        seen = self.follow(coefficients, slopes=False)
        return not self.limits.broken_by_arm(seen.z, seen.tau)

    def fitted(self, coefficients: Coefficients) -> Coefficients:
        """The same shape, squeezed and moved until it keeps the limits."""
        coefficients = self.squeezed(coefficients)
        while not self.keeps_limits(coefficients):
            coefficients[1:] *= 0.9
            if self.start_posture is None:
                coefficients[0] += 0.1 * (0.5 * (self.limits.lower + self.limits.upper) - coefficients[0])
            if np.abs(coefficients[1:]).max() < 1e-3:
                break
        return coefficients

    def squeezed(self, coefficients: Coefficients) -> Coefficients:
        """The same shape within the limits of posture, speed and acceleration; those of the arm are not looked at."""
        tables, overshoot = self.grid()
        limits, fitted = self.limits, coefficients.copy()
        if self.start_posture is not None:
            fitted[0] = self.start_posture
        way, v, a = (overshoot * table[:, 1:] @ fitted[1:] for table in tables)
        low, high = way.min(axis=0), way.max(axis=0)
        room = (limits.upper - fitted[0], fitted[0] - limits.lower)
        squeeze = np.minimum(limits.v_max / _above(v), limits.a_max / _above(a))
        if self.start_posture is None:
            squeeze = np.minimum(squeeze, (limits.upper - limits.lower) / _above(np.array([high - low])))
        else:
            squeeze = np.minimum(squeeze, np.minimum(room[0] / _above(high[None]), room[1] / _above(low[None])))
        squeeze = np.clip(0.999 * squeeze, 0.0, 1.0)
        fitted[1:] *= squeeze
        if self.start_posture is None:
            low, high = fitted[0] + squeeze * low, fitted[0] + squeeze * high
            fitted[0] += np.maximum(limits.lower - low, 0.0) - np.maximum(high - limits.upper, 0.0)
        return fitted

    def _seen(self, coefficients: Coefficients, seen: Along) -> Seen:
        return Seen(self.criterion, self.statistics, seen, self._tables()[0] @ coefficients, self.dt)

    def _tables(self) -> tuple[Any, Any, Any]:
        return self.basis.tables(np.arange(self.samples) * self.dt)


def solve(problem: Problem, start: Coefficients, iterations: int, seconds: float) -> Coefficients:
    """IPOPT from `start`, which keeps the limits; never worse than that, and within the limits too.

    Args:
        problem: What is asked.
        start: Coefficients.
        iterations: At most so many; with them alone the result depends on nothing but the start.
        seconds: At most so long [s].
    """
    evaluation = _Evaluation(problem)
    free = ca.MX.sym("free", start.size)
    everything = evaluation(free)
    coefficients = ca.reshape(free, *reversed(problem.shape)).T
    linear, bound = _linear_limits(problem, coefficients)
    lower, upper = (np.concatenate([side, arm]) for side, arm in zip((-bound, bound), evaluation.bounds(), strict=True))
    nlp = {"x": free, "f": everything[0], "g": ca.vertcat(linear, everything[1:])}
    solver = ca.nlpsol("tell_most", "ipopt", nlp, _options(iterations, seconds))
    held = np.full(problem.shape, np.inf)
    if problem.start_posture is not None:
        held[0] = 0.0
    found = solver(
        x0=start.ravel(), lbx=(start - held).ravel(), ubx=(start + held).ravel(), lbg=lower, ubg=upper
    )  # fmt: skip
    best = problem.fitted(np.asarray(found["x"]).reshape(problem.shape))
    return best if problem.value(best) < problem.value(start) else start


def _options(iterations: int, seconds: float) -> dict[str, Any]:
    return {
        "print_time": False,
        "error_on_fail": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "max_iter": iterations,
            "max_wall_time": float(np.clip(seconds, 0.05, 1e5)),
            "tol": 1e-4,
            "hessian_approximation": "limited-memory",
            "mu_strategy": "adaptive",
        },
    }


def _linear_limits(problem: Problem, coefficients: ca.MX) -> tuple[ca.MX, Vector]:
    """Posture about the middle of its range, speed and acceleration on the grid, and their bounds."""
    tables, overshoot = problem.grid()
    limits = problem.limits
    middle = 0.5 * (limits.lower + limits.upper)
    offsets = (middle, np.zeros_like(middle), np.zeros_like(middle))
    rows = [ca.mtimes(ca.DM(table), coefficients) - ca.DM(np.tile(offset, (len(table), 1)))
            for table, offset in zip(tables, offsets, strict=True)]  # fmt: skip
    bounds = (0.5 * (limits.upper - limits.lower), limits.v_max, limits.a_max)
    bound = np.concatenate([np.repeat(side / overshoot, len(tables[0])) for side in bounds])
    return ca.vertcat(*(ca.vec(row) for row in rows)), bound


class _Evaluation(ca.Callback):
    """Figure of merit, the arm's angles and the torque, for IPOPT, with their slopes."""

    def __init__(self, problem: Problem):
        ca.Callback.__init__(self)
        self._problem = problem
        self._n = int(np.prod(problem.shape))
        self._arm = len(range(0, problem.samples, ARM_EVERY)) * (len(problem.limits.z_lower) + problem.model.n_joints)
        self._known: tuple[bytes, np.ndarray, np.ndarray] | None = None
        self._keep: list[ca.Callback] = []
        self.construct("evaluation", {})

    def bounds(self) -> tuple[Vector, Vector]:
        """Of the arm's angles, then of the torque."""
        limits, count = self._problem.limits, len(range(0, self._problem.samples, ARM_EVERY))
        sides = ((limits.z_lower, -limits.tau_max), (limits.z_upper, limits.tau_max))
        lower, upper = (np.concatenate([np.tile(side, count) for side in pair]) for pair in sides)
        return lower, upper

    def get_sparsity_in(self, _i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._n, 1)

    def get_sparsity_out(self, _i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(1 + self._arm, 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self.both(np.asarray(arg[0]).ravel())[0])]

    def has_jacobian(self, *_args: Any) -> bool:
        return True

    def get_jacobian(self, name: str, _inames: Any, _onames: Any, opts: dict[str, Any]) -> ca.Function:
        self._keep.append(_Slopes(self, name, self._n, 1 + self._arm, opts))
        return self._keep[-1]

    def both(self, free: Vector) -> tuple[np.ndarray, np.ndarray]:
        """All values and their slopes; remembered, since IPOPT asks for one after the other."""
        if self._known is None or self._known[0] != free.tobytes():
            self._known = (free.tobytes(), *self._evaluated(free.reshape(self._problem.shape)))
        return self._known[1], self._known[2]

    def _evaluated(self, coefficients: Coefficients) -> tuple[np.ndarray, np.ndarray]:
        problem = self._problem
        seen = problem.follow(coefficients, slopes=True)
        value, slope = problem.slope(coefficients, seen)
        tables = [table[::ARM_EVERY] for table in problem.basis.tables(np.arange(problem.samples) * problem.dt)]
        n = problem.model.n_joints
        rows = [slope.reshape(1, -1)]
        for by in (seen.z_by, seen.tau_by):
            by_joint = by[::ARM_EVERY].reshape(len(tables[0]), 3, n, -1)
            chained = sum(np.einsum("sb,snf->sfbn", table, by_joint[:, k]) for k, table in enumerate(tables))
            rows.append(np.asarray(chained).reshape(-1, slope.size))
        values = [np.array([value]), seen.z[::ARM_EVERY].ravel(), seen.tau[::ARM_EVERY].ravel()]
        return np.concatenate(values), np.concatenate(rows)


class _Slopes(ca.Callback):
    """Jacobian of an `_Evaluation`."""

    def __init__(self, evaluation: _Evaluation, name: str, n: int, rows: int, opts: dict[str, Any]):
        ca.Callback.__init__(self)
        self._evaluation, self._n, self._rows = evaluation, n, rows
        self.construct(name, opts)

    def get_n_in(self) -> int:
        return 2

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._n, 1) if i == 0 else ca.Sparsity(self._rows, 1)

    def get_sparsity_out(self, _i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._rows, self._n)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self._evaluation.both(np.asarray(arg[0]).ravel())[1])]


def _above(rows: Float[np.ndarray, "point joint"]) -> Float[np.ndarray, " joint"]:
    return np.maximum(np.abs(rows).max(axis=0), 1e-9)
