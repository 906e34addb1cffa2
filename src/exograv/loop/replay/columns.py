"""Ticks as plain columns: reading a field of a packed row takes longer than deciding about it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.loop.pilot import Progress
from exograv.signals import JointState, TorqueSource

PROGRESS_TICKS = 2000

Torques = Float[np.ndarray, "tick joint"]


class Columns:
    """The recorded ticks, field by field, and each measurement as the guard saw it."""

    def __init__(self, ticks: np.ndarray):
        self._columns = {name: np.ascontiguousarray(ticks[name]) for name in ticks.dtype.names or ()}
        self.t, self.now = (self._columns[name].tolist() for name in ("t", "now"))
        numbers = ("control", "seen", "acts", "safe_state", "sequence", "phase", "faulty")
        self.control, self.seen, self.acts, self.safe_state, self.sequence, self.phase, self._faulty = (
            self._columns[name].tolist() for name in numbers
        )
        modes = ("drive", "gravity_level", "arm_share")
        self.mode = list(zip(*(self._columns[name].tolist() for name in modes), strict=True))

    def __len__(self) -> int:
        """Ticks."""
        return len(self.t)

    def __getitem__(self, name: str) -> np.ndarray:
        """One field of all ticks."""
        return self._columns[name]

    def state(self, k: int) -> JointState:
        """What the machine said in a tick."""
        current, q_motor = self["current"][k], self["q_motor"][k]
        has_current = not np.isnan(current).all()
        nothing = np.full(len(current), np.nan)
        faulty = tuple(j for j in range(len(current)) if self._faulty[k] >> j & 1) if self._faulty[k] else ()
        return JointState(
            t=self.t[k],
            sequence=self.sequence[k],
            q=self["q_measured"][k],
            current=current,
            tau=nothing if has_current else self["tau_measured"][k].astype(float),
            torque_source=TorqueSource.CURRENT if has_current else TorqueSource.JOINT_SENSOR,
            q_motor=None if np.isnan(q_motor).all() else q_motor,
            faulty=faulty,
        )


@dataclass
class ReplayedDecisions:
    """What control and guard decided this time, a row a tick; NaN where they did not."""

    tau_desired: Torques
    tau_commanded: Torques
    safe_state: np.ndarray
    """As in a tick."""
    is_rebuilt: np.ndarray
    """Whether control's torque was computed anew (tick,); where not, it is the recorded one."""
    knows_control: np.ndarray
    """Whether control's memory is that of the run (tick,): not shortly after a gap."""
    knows_guard: np.ndarray
    """Likewise of the guard."""
    stops: list[tuple[float, str]] = field(default_factory=list)
    """When the guard stopped the run [s], and why."""
    gaps: list[tuple[float, int]] = field(default_factory=list)
    """When ticks are missing [s], and how many."""
    surprises: list[str] = field(default_factory=list)
    """What control answered otherwise than in the run."""

    @classmethod
    def of(cls, ticks: int, joints: int) -> "ReplayedDecisions":
        """Nothing yet."""
        nothing = np.full((ticks, joints), np.nan)
        known = np.ones((3, ticks), bool)
        return cls(nothing, nothing.copy(), np.zeros(ticks, dtype=np.int64), known[0], known[1], known[2])


def each_tick(columns: Columns, progress: Progress) -> Iterator[int]:
    """Numbers of all ticks in their order; `progress` is told now and then, and at the end."""
    total = len(columns)
    for k in range(total):
        yield k
        if k % PROGRESS_TICKS == 0:
            progress("Deciding once more", k / total)
    progress("Deciding once more", 1.0)
