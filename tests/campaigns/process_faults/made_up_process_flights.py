"""Made-up evidence of flights: commands that fade, drives that brake, and a recording, without any process."""

from dataclasses import dataclass, replace

import numpy as np

from exograv.campaigns.process_faults.drives import DrivesLog
from exograv.campaigns.process_faults.evidence import FlightEvidence, MachineFigures, RecordedTicks
from exograv.safety.guard import SafeState

PERIOD_S, STRUCK_S, BEGIN_S, END_S = 1e-3, 10.0, 9.0, 14.0
MACHINE = MachineFigures(np.array([2.0]), np.array([30.0]), 150.0, np.array([10.0]), 3.0, PERIOD_S)
TAU_NM = 8.0
"""Torque that carries the arm before the strike [N·m]."""


@dataclass(frozen=True)
class Course:
    """Course of a made-up flight, by time after the strike [s]; None for what does not happen."""

    descends_s: float | None = None
    silent_s: float | None = None
    """Time of the last command; the drives brake 20 ms later."""
    extra_Nm: float = 0.0
    """Torque added to each command of the descent [N·m]."""
    steps_Nm: float = 0.0
    """Jump of one command in the middle of the flight [N·m]."""


def evidence_of(course: Course, **changes: object) -> FlightEvidence:
    """Return the evidence of a flight that ended well, with changes."""
    t = np.arange(BEGIN_S, END_S, PERIOD_S)
    descent_t = np.inf if course.descends_s is None else STRUCK_S + course.descends_s
    silent_t = np.inf if course.silent_s is None else STRUCK_S + course.silent_s
    is_descent = t >= descent_t
    share = np.clip(1.0 - np.maximum(t - descent_t, 0.0) / MACHINE.descent_s, 0.0, 1.0)
    ramp = np.minimum(np.maximum(t - descent_t, 0.0) / 0.2, 1.0)
    tau = TAU_NM * share + course.extra_Nm * ramp
    tau[len(tau) // 3] += course.steps_Nm
    is_sent = t < silent_t
    braking = t > silent_t + 0.02
    states = np.where(is_descent, SafeState.DESCENT, SafeState.NONE)[is_sent]
    current, still = (tau / MACHINE.gain)[:, None], np.zeros((len(t), 1))
    drives = DrivesLog(
        t[is_sent] + 2e-4, current[is_sent], t, np.where(braking[:, None], 0.0, current), still, still,
        braking.astype(float), np.empty(0), np.empty(0),
    )  # fmt: skip
    ticks = RecordedTicks(t[is_sent], states, np.arange(int(is_sent.sum())))
    whole = FlightEvidence(drives, STRUCK_S, ticks=ticks, acknowledged=len(ticks.t) - 3, exit_code=0, ended_s=4.0)
    whole = replace(whole, replaced_t=STRUCK_S + 1.0)
    return replace(whole, **changes)  # type: ignore[arg-type]
