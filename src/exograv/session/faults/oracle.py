"""Looks at every torque that goes out, by the envelope's definition written a second time: numbers, bounds, rate."""

import numpy as np
from jaxtyping import Float

from exograv.safety.envelope import Limits
from exograv.safety.person import MARGIN_NM, SHARE_MAX, PersonLimits
from exograv.signals import JointState

Joints = Float[np.ndarray, " joint"]

ROUNDING_NM = 1e-9

FADES, SPEED_SHARE = 0.95, 1.7
"""No low-pass filter of 8 ms is above 1.7 times the greatest difference so far, if that fades by 5 % a tick [-]."""


class Oracle:
    """Of one run; knows what the guard believed of the posture, and nothing of its state."""

    def __init__(self, limits: Limits, person: PersonLimits, period_s: float):
        self._limits, self._person = limits, person
        self._step = limits.torque_rate_max_Nm_per_s * period_s
        self._before: Joints | None = None
        self._q: Joints | None = None
        self._fastest = np.zeros_like(limits.torque_max_Nm)
        self._period_s = period_s
        self.step_Nm = 0.0
        """Greatest change of the last command [N·m]."""

    def judge(
        self, tau: Joints, believed: JointState | None, isolated: frozenset[int], gravity_level: float
    ) -> str | None:
        """What is wrong with a command in words; None where nothing is.

        A torque may be beyond what this posture allows only on its way back, as fast as torque may change.
        """
        if not np.isfinite(tau).all():
            return f"not finite: {tau}"
        if (np.abs(tau) > self._limits.torque_max_Nm + ROUNDING_NM).any():
            return f"above the drives' limit: {tau}"
        before, self._before = self._before, tau.copy()
        change = np.zeros_like(tau) if before is None else tau - before
        self.step_Nm = float(np.abs(change).max())
        if self.step_Nm > self._step + ROUNDING_NM:
            return f"a step of {self.step_Nm:.3f} N·m"
        self._see(believed, isolated)
        if self._q is None:
            return None
        low, high = self._allowed(self._q, gravity_level)
        returns_down = (before is not None) & (change <= -self._step + ROUNDING_NM)
        returns_up = (before is not None) & (change >= self._step - ROUNDING_NM)
        off = ((tau > high + ROUNDING_NM) & ~returns_down) | ((tau < low - ROUNDING_NM) & ~returns_up)
        if before is not None and off.any():
            j = int(np.flatnonzero(off)[0])
            return f"joint {j}: {tau[j]:.3f} N·m, allowed {low[j]:.3f} to {high[j]:.3f}"
        return None

    def _see(self, believed: JointState | None, isolated: frozenset[int]) -> None:
        if believed is None:
            return
        q = believed.q.copy()
        if self._q is not None:
            q[list(isolated)] = self._q[list(isolated)]
        if np.isfinite(q).all():
            now = np.abs(q - (q if self._q is None else self._q)) / self._period_s
            self._fastest = np.maximum(now, FADES * self._fastest)
            self._q = q

    def _allowed(self, q: Joints, gravity_level: float) -> tuple[Joints, Joints]:
        """The widest bounds of the rows: outside of all walls, with friction at any speed that the guard may see."""
        person = self._person
        plausible = np.array(person.table.torque(q, gravity_level))
        beyond = person.table.error + person.table.dry + person.table.viscous * SPEED_SHARE * self._fastest
        up, down = np.maximum(plausible, 0.0), np.minimum(plausible, 0.0)
        high = np.minimum(SHARE_MAX * up + MARGIN_NM, up + person.active_max_Nm) + beyond
        low = np.maximum(SHARE_MAX * down - MARGIN_NM, down - person.active_max_Nm) - beyond
        return low, high
