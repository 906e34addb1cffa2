"""Parameters and report of the guard's process, for its loop in Python and for its loop in C."""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from exograv.errors import ExogravError
from exograv.rig import Rig, may_be_worn
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import PERIOD_NS, Timing
from exograv.runtime.control_loop.exchange import Channels
from exograv.safety.guard import Guard

LIMITS_NS, LIMITS_SHARE = 350_000, 0.35
"""Time that the guard reserves in a period to limit a torque and to write it [ns], and its largest share [-]."""

NATIVE_LIMITS_NS, NATIVE_LIMITS_SHARE = 150_000, 0.25
"""The same for the loop in C, which limits and writes in some 30 µs."""

LOOK_S = 100e-6
"""Time between two looks of the loop for the answer of control [s].

Where both share a processor and the loop has the higher priority, each look interrupts the computation of the answer.
"""

GIVEN_UP_AFTER, ASKED_AGAIN_EVERY = 8, 8
"""Ticks in a row without an answer after which the guard waits in every eighth tick only.

By then the guard has lowered the arm. If it waited in every tick, the loop could run without sleep and would then give
up (`runtime.clock.real_time_loop`).
"""

LONGEST_DESCENT_S = 60.0
"""Time for the guard to let the arm down, after which it is killed [s]: the longest descent that `Limits` may have."""

TIME_IS_OVER = "The time of the run is over: the arm is let down."


@dataclass(frozen=True)
class GuardedRig:
    """Machine and guard of the guard process. They are built in this process, because no other accesses the machine."""

    rig: Rig
    guard: Guard
    gain: np.ndarray
    """Torque per motor current, as calibrated (joint,) [N·m/A]."""

    announce: Callable[[str], object] = lambda _name: None
    """Function that is called with the name of each mode that begins, for the wearer's announcements."""


@dataclass(frozen=True)
class GuardJob:
    """Parameters of a guard process."""

    build: Callable[[], GuardedRig]
    channels: Channels
    periods: int
    """Periods until the end of the run. A machine that may be worn is let down then, in further periods."""

    mode_names: tuple[str, ...]
    notes: Mapping[str, str] = field(default_factory=dict)
    """Notes to record when a mode begins, by the name of the mode."""

    period_ns: int = PERIOD_NS
    """Period of the machine [ns]."""

    is_steered: bool = False
    """True if an operator resets the latch; otherwise a virtual operator resets it."""

    def periods_with_descent(self, rig: Rig) -> int:
        """Return the largest number of periods: those of the run, and of the descent if the machine may be worn."""
        return self.periods + (round(1e9 * LONGEST_DESCENT_S / self.period_ns) if may_be_worn(rig) else 0)


@dataclass(frozen=True)
class StopLatch:
    """Stop of the guard, latched until it is reset."""

    cause: str
    period: int
    at_s: float
    """Time of the stop since the start of the loop [s]."""


@dataclass(frozen=True)
class GuardReport:
    """Report of the guard process at its end."""

    timing: Timing
    rights: Rights
    latches: tuple[StopLatch, ...]
    unanswered: int
    """Ticks without an answer in time."""

    t: float
    """Time of the end on the rig's clock [s]."""

    started_ns: int
    """Start of the first period on CLOCK_MONOTONIC [ns]."""

    modes: tuple[tuple[str, float], ...] = ()
    """Modes in order, each with its start since the start of the loop [s]."""

    failure: str = ""
    """Error in the guard's process that has ended the run; empty if there was none."""


WAITS_NS = 500_000_000
"""Time for which a guard whose machine waits for it waits for control that it has not given up [ns]."""


def answer_by_ns(period_ns: int, is_native: bool = False) -> int:
    """Time after the start of a period by which control must have answered the loop in Python or in C [ns]."""
    most, share = (NATIVE_LIMITS_NS, NATIVE_LIMITS_SHARE) if is_native else (LIMITS_NS, LIMITS_SHARE)
    return period_ns - round(min(most, share * period_ns))


def reported(error: Exception) -> str:
    """Return the line for the recording on an error of the guard; print the traceback of an unforeseen error."""
    if not isinstance(error, ExogravError):
        traceback.print_exception(error)
    return f"The guard had an internal error and lets the arm down: {type(error).__name__}: {error}"
