"""Ticks as plain columns. Reading a field of a packed row would take longer than the decision itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.signals import JointState, TorqueSource

FIELDS = (
    "t", "now", "drive", "gravity_level", "arm_share", "phase", "safe_state", "sequence", "control", "seen", "faulty",
    "acts", "q_measured", "q_reference", "v_reference", "a_reference", "q_motor", "current", "tau_measured",
    "tau_desired", "tau_commanded",
)  # fmt: skip
"""Fields of a tick that a replay reads."""

Torques = Float[np.ndarray, "tick joint"]


class Columns:
    """Columns of recorded ticks that follow each other, and each measurement as the guard received it."""

    def __init__(self, ticks: np.ndarray, first: int = 0, lost: Sequence[int] = ()):
        """Take ticks with at least `FIELDS`.

        Args:
            ticks: The ticks.
            first: Number of the first of them in the recording.
            lost: Number of unrecorded ticks before each; empty if none is missing.
        """
        self.first, self.lost = first, lost or [0] * len(ticks)
        self._columns = {name: np.ascontiguousarray(ticks[name]) for name in ticks.dtype.names or ()}
        self.t, self.now = (self._columns[name].tolist() for name in ("t", "now"))
        numbers = ("control", "seen", "acts", "safe_state", "sequence", "phase", "faulty")
        self.control, self.seen, self.acts, self.safe_state, self.sequence, self.phase, self._faulty = (
            self._columns[name].tolist() for name in numbers
        )
        modes = ("drive", "gravity_level", "arm_share")
        self.mode = list(zip(*(self._columns[name].tolist() for name in modes), strict=True))

    def __len__(self) -> int:
        """Return the number of these ticks."""
        return len(self.t)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one field of these ticks."""
        return self._columns[name]

    def state(self, k: int) -> JointState:
        """Return the measurement of a tick."""
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
    """Decisions of control and guard in the replay: arrays of the present ticks, and findings about all ticks so far.

    The arrays have one row per tick; NaN where there is no decision.
    """

    tau_desired: Torques
    tau_commanded: Torques
    safe_state: np.ndarray
    """Safe states, coded as in a recorded tick."""
    is_rebuilt: np.ndarray
    """True where control's torque was computed again (tick,); elsewhere it is the recorded torque."""
    knows_control: np.ndarray
    """True for ticks in which control's internal state equals that of the run (tick,); false shortly after a gap."""
    knows_guard: np.ndarray
    """True for ticks in which the guard's internal state equals that of the run (tick,)."""
    stops: list[tuple[float, str]] = field(default_factory=list)
    """Times [s] and reasons of the stops by the guard."""
    gaps: list[tuple[float, int]] = field(default_factory=list)
    """Times [s] of gaps, and the number of missing ticks."""
    guard_equal: int = 0
    """Recorded states of the guard that equal those of the replay."""
    guard_differs: list[float] = field(default_factory=list)
    """Times at which they differ [s]."""
    guard_restored: int = 0
    """Recorded states with which the replay went on after a gap."""
    guard_version: str = ""
    """Version of the guard that made the recorded states, if it is another one."""
    surprises: list[str] = field(default_factory=list)
    """Answers of control that differ from those in the run."""

    @classmethod
    def of(cls, ticks: int, joints: int) -> "ReplayedDecisions":
        """Return arrays for the decisions of `ticks` ticks, to be filled in."""
        nothing = np.full((ticks, joints), np.nan)
        known = np.ones((3, ticks), bool)
        return cls(nothing, nothing.copy(), np.zeros(ticks, dtype=np.int64), known[0], known[1], known[2])

    def begin(self, ticks: int) -> None:
        """Take new arrays for the next ticks; the findings stay."""
        new = ReplayedDecisions.of(ticks, self.tau_desired.shape[1])
        self.tau_desired, self.tau_commanded, self.safe_state = new.tau_desired, new.tau_commanded, new.safe_state
        self.is_rebuilt, self.knows_control, self.knows_guard = new.is_rebuilt, new.knows_control, new.knows_guard


ReplayedPiece = tuple[Columns, ReplayedDecisions]
"""Ticks that follow each other, and the decisions about them."""
