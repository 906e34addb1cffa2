"""Transitions of a run by the clock: phases begin, windows open and close, the pace changes."""

from collections.abc import Iterator
from typing import Literal, NamedTuple

from .levels import EARTH, slewed
from .pace import Pace, arrow, pace_changes_s
from .plan import TaskPlan
from .records import ClosedBy, Mark, PaceChanged, PhaseBegan, Record, RunEnded, WindowClosed, WindowOpened
from .schedule import Phase, PhaseKind
from .state import RunState, WindowState

SHORT_SHARE = 0.8
"""Share of a window's duration. Windows that are closed sooner are marked."""

Step = tuple[RunState, tuple[Record, ...]]


class TimedTransition(NamedTuple):
    """Next transition by the clock, and its time."""

    t: float
    what: Literal["phase", "close", "pace"]
    pace: Pace | None = None


def advanced(plan: TaskPlan, state: RunState, t: float) -> Step:
    """Return the run at time `t`, and the records of the transitions until then, each at its own time."""
    records = list[Record]()
    while (due := next_due(plan, state)) is not None and due.t <= t:
        state, more = _happen(plan, state, due)
        records += more
    return state.model_copy(update={"t": max(t, state.t)}), tuple(records)


def next_due(plan: TaskPlan, state: RunState) -> TimedTransition | None:
    """Next transition by the clock; None if there is none."""
    return min(_dues(plan, state), key=lambda due: due.t, default=None)


def _dues(plan: TaskPlan, state: RunState) -> Iterator[TimedTransition]:
    # Of two transitions at the same time the first counts: a window closes before its pace changes.
    if state.status != "running":
        return
    phases, window = plan.timeline.phases, state.window
    if plan.is_clocked:
        index = state.phase + 1
        ends = index == len(phases)
        start_s = plan.timeline.duration_s if ends else phases[index].start_s
        yield TimedTransition(max(state.origin + start_s, state.approach), "phase")
    elif window is not None:
        yield TimedTransition(
            window.opened + plan.protocol.windows.duration_s + _overtime_s(plan, state, window), "close"
        )
    if window is not None:
        since = window.opened if window.cycle.last_touch is None else window.cycle.last_touch
        for after_s, told in pace_changes_s(plan.protocol):
            # Paces follow each other in the order of the enumeration, so only later ones are still to be shown.
            if state.pace is None or list(Pace).index(told) > list(Pace).index(state.pace):
                yield TimedTransition(max(since + after_s, state.t), "pace", told)


def _overtime_s(plan: TaskPlan, state: RunState, window: WindowState) -> float:
    """Time after the nominal end at which the clock closes a window [s]; 0 without a working feed of the aircraft."""
    return plan.protocol.aircraft.overtime_s if window.by == "aircraft" and not state.is_feed_lost else 0.0


def _happen(plan: TaskPlan, state: RunState, due: TimedTransition) -> Step:
    if due.what == "phase":
        return _next_phase(plan, state, due.t)
    if due.what == "pace" and due.pace is not None:
        return tell_pace(plan, state.model_copy(update={"t": due.t}), due.t, due.pace)
    return close_window(plan, state, due.t, "clock")


def _next_phase(plan: TaskPlan, state: RunState, t: float) -> Step:
    records: tuple[Record, ...] = ()
    if state.window is not None:
        state, records = close_window(plan, state, t, "clock")
    index = state.phase + 1
    if index == len(plan.timeline.phases):
        state, more = end(plan, state, t, "")
        return state, (*records, *more)
    phase = plan.timeline.phases[index]
    state = state.model_copy(update={"phase": index, "t": max(t, state.t)})
    records = (*records, phase_record(phase, t))
    if phase.kind is PhaseKind.WINDOW:
        attempt, level = state.attempts(phase.window) + 1, phase.level_from
        opened = WindowOpened(t=t, window=phase.window, attempt=attempt, by="clock", gravity_level=level)
        state, more = open_window(plan, state, opened)
        records = (*records, *more)
    return state, records


def phase_record(phase: Phase, t: float) -> PhaseBegan:
    """Record of the start of a phase."""
    return PhaseBegan(
        t=t,
        phase=phase.kind,
        window=phase.window,
        duration_s=phase.duration_s,
        gravity_level=phase.level_from,
        gravity_level_end=phase.level_to,
    )


def open_window(plan: TaskPlan, state: RunState, opened: WindowOpened) -> Step:
    """Open a window. The participant may move, and the pace counts from here."""
    window = WindowState(
        number=opened.window,
        attempt=opened.attempt,
        epoch=state.epoch,
        opened=opened.t,
        by=opened.by,
        marks=("not confirmed",) if opened.confirmed is False else (),
    )
    state = state.model_copy(update={"windows": (*state.windows, window)})
    state, told = tell_pace(plan, state, opened.t, Pace.TOO_SHORT)
    return state, (opened, *told)


def close_window(plan: TaskPlan, state: RunState, t: float, by: ClosedBy) -> Step:
    """Close the open window. A window that was broken off must be run again."""
    window = state.window
    if window is None:
        return state, ()
    marks: list[Mark] = list(window.marks)
    is_complete = by in ("clock", "aircraft", "hand")
    if is_complete and t - window.opened < SHORT_SHARE * plan.protocol.windows.duration_s:
        marks.append("short")
    if by == "clock" and _overtime_s(plan, state, window) > 0.0:
        marks.append("overtime")
    state = state.with_window(
        len(state.windows) - 1, closed=t, closed_by=by, is_complete=is_complete, marks=tuple(marks)
    ).model_copy(update={"pace": None})
    record = WindowClosed(
        t=t,
        window=window.number,
        attempt=window.attempt,
        by=by,
        is_complete=is_complete,
        marks=tuple(marks),
    )
    if not plan.is_clocked and is_complete and state.complete >= set(plan.protocol.windows.numbers):
        state, more = end(plan, state, t, "")
        return state, (record, *more)
    return state, (record,)


def tell_pace(plan: TaskPlan, state: RunState, t: float, told: Pace) -> Step:
    """Change the pace that the arrow shows."""
    window = state.window
    if window is None:
        return state, ()
    is_shown = arrow(plan.protocol, told) is not None
    record = PaceChanged(t=t, window=window.number, pace=told, is_shown=is_shown)
    return state.model_copy(update={"pace": told}), (record,)


def end(plan: TaskPlan, state: RunState, t: float, why: str) -> Step:
    """End the run. It is complete if all windows are. The level goes from its present value to 1."""
    is_complete = state.complete >= set(plan.protocol.windows.numbers)
    left = {"left_at": t, "left_level": made_level(plan, state, t), "t": max(t, state.t)}
    status = "stopped" if why else "finished"
    return state.model_copy(update={"status": status, **left}), (RunEnded(t=t, is_complete=is_complete, why=why),)


def made_level(plan: TaskPlan, state: RunState, t: float) -> float:
    """Gravity level that the task requests from the machine at time `t` [-]. It changes without steps."""
    if state.status == "running" and plan.is_clocked and t >= state.approach:
        return plan.timeline.made_level_at(t - state.origin, plan.exo)
    return slewed(state.left_level, EARTH, t - state.left_at)
