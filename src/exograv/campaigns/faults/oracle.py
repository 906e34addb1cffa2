"""Oracle of the envelope: checks every sent torque against a second implementation of its limits.

The oracle collects data during a run and judges all ticks at once afterwards, which takes a hundredth of the time.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native.core import MARGIN_NM, SHARE_MAX
from exograv.safety.plausible import PlausibleTable

Joints = Float[np.ndarray, " joint"]
Rows = Float[np.ndarray, "tick joint"]

ROUNDING_NM = 1e-9

FADES, SPEED_SHARE = 0.95, 1.7
"""Decay per tick and factor of the speed bound [-]. The output of an 8 ms low-pass filter never exceeds 1.7 times the
greatest difference so far, if that difference decays by 5 % per tick."""

SPEED_FLOOR_RAD_S = 1e-30
"""Speed floor below every real speed [rad/s]; it keeps the logarithm finite."""


@dataclass(frozen=True)
class Judgement:
    """Judgement of one run, one entry per tick."""

    wrong: dict[int, str]
    """Violations of the envelope, one sentence per tick, by the number of the tick."""

    step_Nm: Float[np.ndarray, " tick"]
    """Largest change of a command from the previous one [N·m]."""


class EnvelopeOracle:
    """Independent judge of one run.

    It knows the posture that the guard accepted, but no internal state of the guard.
    """

    def __init__(self, limits: Limits, person: PersonLimits, period_s: float, rounding_Nm: float = ROUNDING_NM):
        """Begin before the first command.

        Args:
            limits: Limits of the machine.
            person: Limits of the wearer.
            period_s: Time between two commands [s].
            rounding_Nm: Tolerance for rounding of a torque [N·m].
        """
        self._limits, self._person, self._period_s, self._rounding = limits, person, period_s, rounding_Nm
        self._step = limits.torque_rate_max_Nm_per_s * period_s + rounding_Nm
        self._tau: list[Joints] = []
        self._q: list[Joints] = []
        self._level: list[float] = []
        self._unknown = np.full_like(limits.torque_max_Nm, np.nan)

    def note(self, tau: Joints, q: Joints | None, isolated: frozenset[int], gravity_level: float) -> None:
        """Note the command of one tick and the posture that the guard accepted; None without a measurement."""
        before = self._q[-1] if self._q else self._unknown
        if q is not None and isolated:
            # Isolated joints come first: their rejected positions must not affect the positions of other joints.
            kept = list(isolated)
            q = q.copy()
            q[kept] = before[kept]
        if q is None or not np.isfinite(q).all():
            q = before
        self._tau.append(tau)
        self._q.append(q)
        self._level.append(gravity_level)

    @property
    def ticks(self) -> int:
        """Number of noted ticks that the next judgement knows."""
        return len(self._tau)

    def forget(self, kept: int) -> None:
        """Forget all noted ticks but the last ones. They still bound the rate, the posture and the speed."""
        for noted in (self._tau, self._q, self._level):
            del noted[:-kept]

    def judge(self) -> Judgement:
        """Judge all noted ticks.

        A torque may exceed the bounds of its posture only while it returns at the full rate limit.
        """
        n = len(self._unknown)
        tau, q = np.array(self._tau).reshape(-1, n), np.array(self._q).reshape(-1, n)
        change = np.diff(tau, axis=0, prepend=tau[:1])
        step = np.abs(change).max(axis=1, initial=0.0)
        low, high = self._allowed(q, np.array(self._level))
        too_far = np.maximum(self._off(tau, change, high), self._off(-tau, -change, -low))
        worst = too_far.argmax(axis=1)
        claims = (
            (~np.isfinite(tau).all(axis=1), lambda k, _: f"not finite: {tau[k]}"),
            (self._too_strong(tau), lambda k, _: f"above the drives' limit: {tau[k]}"),
            (step > self._step, lambda k, _: f"a step of {step[k]:.3f} N·m"),
            (
                too_far.any(axis=1) & (np.arange(len(tau)) > 0),
                lambda k, j: f"joint {j}: {tau[k, j]:.3f} N·m, allowed {low[k, j]:.3f} to {high[k, j]:.3f}",
            ),
        )
        wrong: dict[int, str] = {}
        for is_so, words in claims:
            for k in np.flatnonzero(is_so).tolist():
                wrong.setdefault(k, words(k, int(worst[k])))
        return Judgement(dict(sorted(wrong.items())), step)

    def _too_strong(self, tau: Rows) -> Bool[np.ndarray, " tick"]:
        return np.logical_or.reduce(np.abs(tau) > self._limits.torque_max_Nm + self._rounding, axis=1)

    def _off(self, tau: Rows, change: Rows, high: Rows) -> Bool[np.ndarray, "tick joint"]:
        """Return True where a torque is above its bound and does not fall fast enough. A NaN bound gives False."""
        off = (tau > high + self._rounding) & (change > 2.0 * self._rounding - self._step)
        return np.asarray(off, dtype=bool)

    def _allowed(self, q: Rows, gravity_level: Float[np.ndarray, " tick"]) -> tuple[Rows, Rows]:
        """Widest bounds of each tick: outside of all walls, with friction at any speed that the guard may estimate."""
        person, table = self._person, self._person.table
        plausible = carrying(table, q, gravity_level)
        beyond = table.error + table.dry + table.viscous * SPEED_SHARE * self._fastest(q)
        up, down = np.maximum(plausible, 0.0), np.minimum(plausible, 0.0)
        high = np.minimum(SHARE_MAX * up + MARGIN_NM, up + person.active_max_Nm) + beyond
        low = np.maximum(SHARE_MAX * down - MARGIN_NM, down - person.active_max_Nm) - beyond
        return low, high

    def _fastest(self, q: Rows) -> Rows:
        """Greatest speed so far with decay: max over i of FADES^(k − i) · speed_i, computed with logarithms [rad/s]."""
        speed = np.nan_to_num(np.abs(np.diff(q, axis=0, prepend=q[:1])) / self._period_s)
        fading = np.arange(len(q))[:, None] * np.log(FADES)
        return np.exp(np.maximum.accumulate(np.log(speed + SPEED_FLOOR_RAD_S) - fading) + fading)


def carrying(table: PlausibleTable, q: Rows, gravity_level: Float[np.ndarray, " tick"]) -> Rows:
    """Torque of `table.torque` at each posture [rad], computed without the guard's code [N·m]."""
    tau = np.empty_like(q)
    for chain in table.chains:
        joints, most = list(chain.joints), chain.most_factors
        depends = _dependences(len(joints))
        factors, arm_share = depends.sum(axis=1), (1.0 - gravity_level)[:, None]
        features = _products(q[:, joints])[:, factors <= most]
        tau[:, joints] = features @ chain.exo.T + arm_share * (features @ chain.arm.T)
        further = (most < factors) & (factors <= chain.potential_factors)
        for j, joint in enumerate(joints if further.any() else []):
            # The derivative of a sine or a cosine is its value a quarter turn ahead.
            ahead = q[:, joints] + 0.5 * np.pi * (np.arange(len(joints)) == j)
            both = (_products(ahead) * depends[:, j])[:, further] @ chain.potential.T
            tau[:, joint] += both[:, 0] + arm_share[:, 0] * both[:, 1]
    return tau


def power_beyond(
    table: PlausibleTable, tau: Rows, q: Rows, v: Rows, gravity_level: Float[np.ndarray, " tick"]
) -> Float[np.ndarray, " tick"]:
    """Power of the commanded torque into the person, beyond carrying and beyond calibrated friction [W].

    Args:
        table: Torque that carries this person's arm.
        tau: Commanded torque [N·m].
        q: True joint positions [rad].
        v: True joint velocities [rad/s].
        gravity_level: Felt share of the arm's weight [-].
    """
    over = tau - carrying(table, q, gravity_level)
    friction = table.dry + table.viscous * np.abs(v)
    drives = over * v > 0.0
    over = np.where(drives, np.sign(over) * np.maximum(np.abs(over) - friction, 0.0), over)
    return (over * v).sum(axis=1)


def _products(q: Rows) -> Float[np.ndarray, "tick product"]:
    """Products of 1, cos or sin of each joint; the first joint changes fastest."""
    products = np.ones((len(q), 1))
    for column in q.T:
        each = np.stack([np.ones_like(column), np.cos(column), np.sin(column)], axis=1)
        products = (each[:, :, None] * products[:, None, :]).reshape(len(q), -1)
    return products


def _dependences(joints: int) -> Bool[np.ndarray, "product joint"]:
    """Return True where a product depends on the angle of a joint."""
    return np.arange(3**joints)[:, None] // 3 ** np.arange(joints) % 3 > 0
