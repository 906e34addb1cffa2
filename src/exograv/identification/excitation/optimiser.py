"""Optimiser of motions inside the limits: IPOPT with exact gradients and a limited-memory BFGS Hessian.

Source: Wächter & Biegler 2006, Math Program 106:25 (IPOPT), through CasADi.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from jaxtyping import Float

from .basis import Coefficients
from .problem import MotionProblem

ARM_EVERY = 2
"""Stride of the samples at which arm angles (comfort range) and joint torques are constrained; both change slowly."""

SHARES = (1.0, 0.7, 0.4, 0.2)
"""Shares of the way from the start to the solution that are tried as results [-]."""

Vector = Float[np.ndarray, " coefficient"]


def solve(problem: MotionProblem, start: Coefficients, iterations: int, seconds: float) -> Coefficients:
    """Run IPOPT from `start`, which must keep the limits; the result keeps them too and is never worse.

    Args:
        problem: Figure of merit and limits.
        start: Coefficients of the start.
        iterations: Largest number of iterations. If only they end the search, the result depends only on the start.
        seconds: Largest duration [s].
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
    # CasADi turns Ctrl-C during the search into an early end; the command must end too.
    if solver.stats()["return_status"] in ("User_Requested_Stop", "NonIpopt_Exception_Thrown"):
        raise KeyboardInterrupt
    way = np.asarray(found["x"]).reshape(problem.shape) - start
    # An early end leaves IPOPT outside the limits. A part of the way is often better than the whole way scaled down.
    candidates = [problem.fitted(start + share * way) for share in SHARES]
    return min([start, *candidates], key=problem.value)


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


def _linear_limits(problem: MotionProblem, coefficients: ca.MX) -> tuple[ca.MX, Vector]:
    """Posture relative to the middle of its range, speed and acceleration on the grid, and their bounds."""
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
    """Callback of IPOPT for figure of merit, arm angles and torque, with their gradients."""

    def __init__(self, problem: MotionProblem):
        ca.Callback.__init__(self)
        self._problem = problem
        self._n = int(np.prod(problem.shape))
        self._arm = len(range(0, problem.samples, ARM_EVERY)) * (len(problem.limits.z_lower) + problem.model.n_joints)
        self._known: tuple[bytes, np.ndarray, np.ndarray] | None = None
        self._keep: list[ca.Callback] = []
        self.construct("evaluation", {})

    def bounds(self) -> tuple[Vector, Vector]:
        """Bounds of the arm angles [rad], then of the torque [N·m]."""
        limits, count = self._problem.limits, len(range(0, self._problem.samples, ARM_EVERY))
        sides = ((limits.z_lower, -limits.tau_max), (limits.z_upper, limits.tau_max))
        lower, upper = (np.concatenate([np.tile(side, count) for side in pair]) for pair in sides)
        return lower, upper

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._n, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(1 + self._arm, 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self.both(np.asarray(arg[0]).ravel())[0])]

    def has_jacobian(self, *_args: Any) -> bool:
        return True

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Mapping[str, Any]) -> ca.Function:
        self._keep.append(_Slopes(self, name, self._n, 1 + self._arm, opts))
        return self._keep[-1]

    def both(self, free: Vector) -> tuple[np.ndarray, np.ndarray]:
        """Return all values and their gradients; cached, because IPOPT calls for them one after the other."""
        if self._known is None or self._known[0] != free.tobytes():
            self._known = (free.tobytes(), *self._evaluated(free.reshape(self._problem.shape)))
        return self._known[1], self._known[2]

    def _evaluated(self, coefficients: Coefficients) -> tuple[np.ndarray, np.ndarray]:
        problem = self._problem
        seen = problem.follow(coefficients, slopes=True)
        value, slope = problem.slope(coefficients, seen)
        tables = [table[::ARM_EVERY] for table in problem.tables()]
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

    def __init__(self, evaluation: _Evaluation, name: str, n: int, rows: int, opts: Mapping[str, Any]):
        ca.Callback.__init__(self)
        self._evaluation, self._n, self._rows = evaluation, n, rows
        self.construct(name, opts)

    def get_n_in(self) -> int:
        return 2

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._n, 1) if i == 0 else ca.Sparsity(self._rows, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._rows, self._n)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self._evaluation.both(np.asarray(arg[0]).ravel())[1])]
