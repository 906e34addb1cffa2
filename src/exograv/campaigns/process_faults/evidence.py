"""Evidence of one flight, collected from outside of the session: drives, recording, memory, processes, terminal."""

from dataclasses import dataclass

import numpy as np

from .bare_loops import HostPause
from .drives import DrivesLog


@dataclass(frozen=True)
class MachineFigures:
    """Figures of the machine that the judge needs."""

    gain: np.ndarray
    """Torque per motor current (joint,) [N·m/A]."""
    torque_max_Nm: np.ndarray
    torque_rate_max_Nm_per_s: float
    damping_Nms_per_rad: np.ndarray
    """Damping in the soft descent (joint,)."""
    descent_s: float
    period_s: float


@dataclass(frozen=True)
class RecordedTicks:
    """Ticks of the recording that the judge needs."""

    t: np.ndarray
    """Begin of each tick on CLOCK_MONOTONIC [s]."""
    safe_state: np.ndarray
    """Safe state of each tick, as `SafeState`."""
    sequence: np.ndarray
    """Number of the measurement of each tick."""
    stop: str = ""
    """Reason of the first stop, as a sentence; empty without a stop."""


@dataclass(frozen=True)
class FlightEvidence:
    """Record of one flight; times on CLOCK_MONOTONIC [s]."""

    drives: DrivesLog
    struck_t: float | None
    """Time of the strike; None if the session was not struck."""
    stopped_before: str = ""
    """Reason why the session ended before the strike; empty if it was struck in its state."""
    pressed_t: float | None = None
    """Time at which Stop was pressed before the strike; None if it was not."""
    released_t: float | None = None
    """Time at which the campaign pressed Stop after the strike and woke stopped processes; None if it did not."""
    resumed_t: float | None = None
    """Time at which a suspended session was woken; None without a suspend."""
    ticks: RecordedTicks | None = None
    recording_why: str = ""
    """Reason why the recording cannot be read; empty if it can."""
    acknowledged: int = 0
    """Number of ticks that the recorder had acknowledged when the campaign looked last."""
    exit_code: int | None = None
    """Exit code of the command; None if the campaign had to end it."""
    output: str = ""
    """Text on the terminal."""
    left_processes: tuple[str, ...] = ()
    left_memory: tuple[str, ...] = ()
    ended_s: float | None = None
    """Time from the strike to the end of the command [s]."""
    replaced_t: float | None = None
    """Time at which a process of the same name started after the strike; None if there was none."""
    has_silent_pages: bool = False
    """True if the pages, which were struck, did not answer at their first address before the end."""
    host_pauses: tuple[HostPause, ...] | None = None
    """Pauses of the bare loops beside the session; None if they had no real-time priority."""
