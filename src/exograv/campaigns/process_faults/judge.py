"""Judge of one flight: what was seen from outside, against the table of expected outcomes."""

from dataclasses import dataclass, field, replace

import numpy as np

from exograv.safety.guard import IN_WINDOW_MAX_MS, SafeState
from exograv.safety.stops import StopReason

from .bare_loops import paused_s
from .cell import Cell, Fault, Process, State
from .evidence import FlightEvidence, MachineFigures
from .gaps import TickGaps, gaps_of
from .table import Expected, Outcome
from .torque import torque_faults

BRAKES_FOR_S = 0.05
"""Duration of braking that counts as the drives' own watchdog [s]. A few late commands cause a shorter one."""

LATE_WITHIN_S, IN_TIME_S = 0.1, 2e-3
"""Time before a stop in which the guard's own ticks are looked at, and gap between two of them that is in time [s]."""

SHARE_OF_DESCENT = 0.9
"""Share of the descent that must have passed before the drives may brake [-]."""


PAUSES = (StopReason.CONTROL_SILENT.value, StopReason.MACHINE_SILENT.value)
"""Reasons of a stop for which nothing but the computer need be slow."""

BEFORE_STOP_S, EXCUSE_MS = 1.0, float(IN_WINDOW_MAX_MS)
"""Time before a stop in which pauses of the computer count [s], and pause from which the guard misses more ticks than
it bridges [ms]."""


@dataclass(frozen=True)
class CellVerdict:
    """Verdict on one cell."""

    cell: str
    status: str
    """"as expected", "late", "not as expected", "not flown" or "not in this session"."""
    seen: str = ""
    """Outcome that was seen."""
    expected: str = ""
    reaction_ms: float | None = None
    budget_ms: float | None = None
    stall_ms: float = 0.0
    """Delay by the computer itself near the strike [ms], added to the budget."""
    host_ms: float | None = None
    """Pauses of the bare loops before the reaction [ms]; None without bare loops or reaction."""
    faults: tuple[str, ...] = ()
    """Sentences about all that is not as expected, or the reason why the cell was not flown."""
    exit_code: int | None = None
    ended_s: float | None = None
    tries: int = 1
    gaps: TickGaps = field(default_factory=TickGaps)

    @property
    def is_to_repeat(self) -> bool:
        """True if another flight may show more: not struck, or a late cell beside bare loops."""
        return self.status == "not flown" or (self.status == "late" and self.host_ms is not None)

    def settled(self) -> "CellVerdict":
        """Return the verdict after the last flight: without a pause of the computer, nothing excuses a late cell."""
        is_excused = self.host_ms is None or self.host_ms >= EXCUSE_MS
        return self if self.status != "late" or is_excused else replace(self, status="not as expected")

    def is_bad(self, on_shared: bool = False) -> bool:
        """Return True if the cell was flown and is not as expected, or could not be flown.

        Args:
            on_shared: True for a computer that others use, too. What a pause of it can cause is not bad then: a late
                reaction, and a session that ended before its strike.
        """
        return self.status == "not as expected" or (not on_shared and self.status in ("late", "not flown"))


@dataclass(frozen=True)
class Seen:
    """Reaction that was seen."""

    outcome: Outcome
    at: float | None
    """Beginning of the descent or of the brakes on CLOCK_MONOTONIC [s]; None without a reaction."""


def judge(cell: Cell, expected: Expected, evidence: FlightEvidence, machine: MachineFigures) -> CellVerdict:
    """Return the verdict on one flight: outcome, torque, recording and end against the expected reaction."""
    if evidence.stopped_before or evidence.struck_t is None:
        why = evidence.stopped_before or "the hook did not act"
        stop = "" if evidence.ticks is None or not evidence.ticks.stop else f" ({evidence.ticks.stop})"
        return CellVerdict(cell.name, "not flown", faults=(f"not flown: {why}{stop}",))
    if evidence.pressed_t is not None and evidence.struck_t > evidence.pressed_t + SHARE_OF_DESCENT * machine.descent_s:
        return CellVerdict(cell.name, "not flown", faults=("not flown: the descent was over before the strike",))
    seen = reaction(cell, evidence, machine)
    if cell.state is not State.DESCENDING and seen.outcome is Outcome.LOWERED and drives_were_late(evidence):
        return CellVerdict(cell.name, "not flown", faults=("not flown: the simulated drives were late",))
    reaction_ms = None if seen.at is None else round(1e3 * (seen.at - evidence.struck_t), 1)
    stall_ms = round(_stall_ms(evidence, machine), 1)
    host_ms = _host_ms(seen, evidence)
    late, wrong = _outcome_faults(cell, expected, seen, reaction_ms, stall_ms, evidence)
    excess_ms = 0.0 if expected.budget_ms is None else (reaction_ms or 0.0) - expected.budget_ms - stall_ms
    if late and seen.outcome in expected.outcomes and host_ms is not None and host_ms < excess_ms:
        late, wrong = [], [f"{one}; the bare loops paused for {host_ms:g} ms" for one in late]
    faults = [
        *wrong,
        *torque_faults(evidence, machine, _descent_begin(cell, seen, evidence)),
        *recording_faults(cell, evidence),
        *_end_faults(expected, evidence),
        *_neighbour_faults(seen, expected, evidence),
    ]
    return CellVerdict(
        cell.name,
        "not as expected" if faults else "late" if late else "as expected",
        seen.outcome.value,
        " or ".join(outcome.value for outcome in expected.outcomes),
        None if cell.state is State.DESCENDING and seen.outcome is Outcome.LOWERED else reaction_ms,
        expected.budget_ms,
        stall_ms,
        host_ms,
        (*late, *faults),
        evidence.exit_code,
        None if evidence.ended_s is None else round(evidence.ended_s, 2),
        gaps=gaps_of(evidence),
    )


def reaction(cell: Cell, evidence: FlightEvidence, machine: MachineFigures) -> Seen:
    """Return what guard or drives did between the strike and a later Stop of the campaign."""
    assert evidence.struck_t is not None
    until = np.inf if evidence.released_t is None else evidence.released_t
    brake = brakes_at(evidence)
    descent = evidence.pressed_t if cell.state is State.DESCENDING else descent_at(evidence)
    brake = None if brake is not None and brake >= until else brake
    descent = None if descent is not None and descent >= until else descent
    if descent is None and brake is None:
        return Seen(Outcome.GOES_ON, None)
    lasts_s = SHARE_OF_DESCENT * machine.descent_s
    if brake is not None and (descent is None or brake < descent + lasts_s):
        return Seen(Outcome.BRAKED, brake)
    return Seen(Outcome.LOWERED, descent)


def brakes_at(evidence: FlightEvidence) -> float | None:
    """Return the time after the strike at which all drives begin to brake for `BRAKES_FOR_S` [s]; None if never."""
    drives, struck = evidence.drives, evidence.struck_t
    braking = (drives.is_braking > 0.0) & (drives.step_t >= (struck or 0.0))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], braking.astype(int), [0]])))
    for first, end in edges.reshape(-1, 2):
        if drives.step_t[end - 1] - drives.step_t[first] >= BRAKES_FOR_S:
            return float(drives.step_t[first])
    return None


def descent_at(evidence: FlightEvidence) -> float | None:
    """Return the time after the strike of the first command of a descent [s]; None if there was none."""
    ticks = evidence.ticks
    if ticks is None:
        return None
    after = np.flatnonzero((ticks.safe_state >= SafeState.DESCENT) & (ticks.t >= (evidence.struck_t or 0.0)))
    if not len(after):
        return None
    begun = float(ticks.t[after[0]])
    sent = evidence.drives.command_t[evidence.drives.command_t >= begun]
    return float(sent[0]) if len(sent) else begun


def drives_were_late(evidence: FlightEvidence) -> bool:
    """Return True if the guard stopped because the simulated drives answered late, though its own ticks were in time.

    The drives are a process of this computer, too: such a flight proves nothing about the strike.
    """
    ticks = evidence.ticks
    if ticks is None or ticks.stop != StopReason.MACHINE_SILENT.value:
        return False
    stopped = np.flatnonzero((ticks.safe_state >= SafeState.DESCENT) & (ticks.t >= (evidence.struck_t or 0.0)))
    if not len(stopped):
        return False
    before = ticks.t[(ticks.t >= ticks.t[stopped[0]] - LATE_WITHIN_S) & (ticks.t <= ticks.t[stopped[0]])]
    return bool(np.diff(before).max(initial=0.0) < IN_TIME_S)


def recording_faults(cell: Cell, evidence: FlightEvidence) -> list[str]:
    """Return what is wrong with the recording: it must be readable to the last acknowledged tick, without a gap."""
    ticks = evidence.ticks
    if ticks is None:
        return [f"the recording cannot be read: {evidence.recording_why}"]
    faults = []
    if len(ticks.t) < evidence.acknowledged:
        faults.append(f"the recording has {len(ticks.t)} ticks, and {evidence.acknowledged} were acknowledged")
    is_full = cell.fault in (Fault.DISK, Fault.SUSPEND) or cell.process in (Process.GUARD, Process.SESSION)
    if not is_full and evidence.struck_t is not None and (not len(ticks.t) or ticks.t[-1] < evidence.struck_t):
        faults.append("the recording ends before the strike")
    return faults


def _outcome_faults(
    cell: Cell, expected: Expected, seen: Seen, reaction_ms: float | None, stall_ms: float, evidence: FlightEvidence
) -> tuple[list[str], list[str]]:
    """Return findings that a pause of the computer explains, and others."""
    allowed = set(expected.outcomes)
    if cell.state is State.DESCENDING and Outcome.GOES_ON in allowed:
        allowed.add(Outcome.LOWERED)
    if seen.outcome not in allowed:
        after = "" if reaction_ms is None else f" after {reaction_ms:g} ms"
        said = [f"{seen.outcome}{after}, expected: {' or '.join(sorted(allowed))}, because {expected.why}"]
        stop = "" if evidence.ticks is None else evidence.ticks.stop
        return (said, []) if seen.outcome is Outcome.LOWERED and stop in PAUSES else ([], said)
    is_timed = seen.at is not None and not (cell.state is State.DESCENDING and seen.outcome is Outcome.LOWERED)
    if is_timed and expected.budget_ms is not None and (reaction_ms or 0.0) > expected.budget_ms + stall_ms:
        said = [f"{seen.outcome} after {reaction_ms:g} ms; budget {expected.budget_ms:g} and stall {stall_ms:g} ms"]
        return said, []
    return [], []


def _descent_begin(cell: Cell, seen: Seen, evidence: FlightEvidence) -> float | None:
    """Time at which the last descent began [s]; None if the drives braked, or if the session went on to its end."""
    if seen.outcome is Outcome.BRAKED:
        return None
    return seen.at if seen.outcome is Outcome.LOWERED else descent_at(evidence)


def _end_faults(expected: Expected, evidence: FlightEvidence) -> list[str]:
    faults = []
    if evidence.exit_code is None:
        faults.append("the command did not end, also not after Stop")
    elif expected.exits is not None and evidence.exit_code not in expected.exits:
        allowed = " or ".join(str(code) for code in expected.exits)
        faults.append(f"exit code {evidence.exit_code}, expected: {allowed}")
    if evidence.left_processes:
        faults.append(f"processes that did not end: {', '.join(evidence.left_processes)}")
    if evidence.left_memory:
        faults.append(f"left in /dev/shm: {', '.join(evidence.left_memory)}")
    return faults


def _neighbour_faults(seen: Seen, expected: Expected, evidence: FlightEvidence) -> list[str]:
    """Return what is wrong with the process itself: it must be replaced, or told as lost exactly once.

    A session that ends does neither.
    """
    if seen.outcome is not Outcome.GOES_ON:
        return []
    faults = []
    if expected.is_replaced and evidence.replaced_t is None:
        faults.append("the process was not replaced")
    if evidence.has_silent_pages:
        faults.append("the pages did not answer at their address any more")
    if expected.told and (count := evidence.output.count(expected.told)) != 1:
        faults.append(f"the loss of the process was told {count} times, expected: once")
    return faults


def _host_ms(seen: Seen, evidence: FlightEvidence) -> float | None:
    """Pauses of the bare loops in the second before the reaction [ms]."""
    if evidence.host_pauses is None or seen.at is None:
        return None
    return round(1e3 * paused_s(evidence.host_pauses, seen.at - BEFORE_STOP_S, seen.at), 1)


def _stall_ms(evidence: FlightEvidence, machine: MachineFigures) -> float:
    """Pauses of the simulated drives themselves near the strike [ms]: real drives do not pause."""
    drives, struck = evidence.drives, evidence.struck_t or 0.0
    near = (drives.pause_t >= struck) & (drives.pause_t - drives.pause_s <= struck + 0.1)
    return 1e3 * float(drives.pause_s[near].sum())
