"""Events of operator, aircraft and program in a run: start, pause, resume, open and close windows, stop."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from exograv.sentence import Sentence, say

from .events import CloseWindow, FeedBack, FeedLost, Interrupted, OpenWindow, Pause, Resume, Start, Stop
from .levels import EARTH, slewing_s
from .plan import TaskPlan
from .records import AlarmRaised, Paused, Record, Resumed, RunBegan, WindowOpened
from .state import RunAlarm, RunState
from .timed_transitions import Step, close_window, end, made_level, open_window

RESUME_NOTICE_S = 3.0
"""Shortest time from the operator's command to the first ramp of the window [s].

It prevents a surprise for the wearer.
"""

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "aircraft.contradicted": "g has opened a window, and the aircraft announces something else.",
        "aircraft.lost": "The aircraft's data have stopped: open and close windows by hand.",
        "aircraft.lost_in_window": (
            "The aircraft's data have stopped: window {window} ends by the clock, the next open by hand."
        ),
    }
)
"""English texts of the alarms, by code."""

Outcome = Step | str
"""Step that an event causes, or the reason why it is refused."""


def start(plan: TaskPlan, state: RunState, event: Start) -> Outcome:
    """Start the run with the first rest, whose phase is due at once."""
    if state.status != "ready":
        return f"the run is {state.status}; a run starts once"
    pitch = None if plan.screen is None else (plan.screen.pitch_x_mm, plan.screen.pitch_y_mm)
    record = RunBegan(
        t=event.t, protocol=plan.protocol.name, protocol_sha256=plan.loaded.sha256, pitch_mm=pitch,
        windows=len(plan.protocol.windows.numbers), participant=event.participant, session=event.session,
    )  # fmt: skip
    times = dict.fromkeys(("t", "origin", "approach", "left_at"), event.t)
    begun = {"status": "running", "protocol_sha256": plan.loaded.sha256, **times}
    return state.model_copy(update=begun), (record,)


def open_next(plan: TaskPlan, state: RunState, event: OpenWindow) -> Outcome:
    """Open the next window now."""
    if state.status != "running":
        return f"the run is {state.status}; a window opens while it is running"
    if plan.is_clocked:
        return "the clock opens the windows of this protocol; resume the run at a window instead"
    if state.window is not None:
        return f"window {state.window.number} is open already"
    number = state.next_window(plan.protocol.windows.numbers) if state.wanted is None else state.wanted
    if number is None:
        return "all windows are complete"
    state = state.model_copy(update={"wanted": None})
    opened = WindowOpened(
        t=event.t,
        window=number,
        attempt=state.attempts(number) + 1,
        by=event.by,
        gravity_level=plan.protocol.windows.level_of(number).start,
        since=event.since,
        parabola=event.parabola,
        confirmed=event.confirmed,
    )
    state, records = open_window(plan, state, opened)
    if event.confirmed is False:
        state, more = raise_alarm(state, say(SENTENCES, "aircraft.contradicted"))
        records = (*records, *more)
    return state, records


def close_open(plan: TaskPlan, state: RunState, event: CloseWindow) -> Outcome:
    """Close the open window now. A command of the aircraft for a window that the clock has closed changes nothing."""
    if plan.is_clocked:
        return "the clock closes the windows of this protocol; pause the run instead"
    if state.window is None:
        return (state, ()) if event.by == "aircraft" else "no window is open"
    return close_window(plan, state, event.t, event.by)


def lose_feed(plan: TaskPlan, state: RunState, event: FeedLost) -> Outcome:
    """Mark the feed as lost. A window that the aircraft opened goes on by the clock, to its nominal end."""
    if state.is_feed_lost:
        return state, ()
    state = state.model_copy(update={"is_feed_lost": True})
    window = state.window
    text = say(SENTENCES, "aircraft.lost")
    if window is not None and window.by == "aircraft":
        state = state.with_window(len(state.windows) - 1, marks=(*window.marks, "feed lost"))
        text = say(SENTENCES, "aircraft.lost_in_window", window=window.number)
    return raise_alarm(state, text)


def hear_feed(plan: TaskPlan, state: RunState, event: FeedBack) -> Outcome:
    """Mark the feed as available again."""
    return state.model_copy(update={"is_feed_lost": False}), ()


def pause(plan: TaskPlan, state: RunState, event: Pause) -> Outcome:
    """Break off the window; the level goes to 1."""
    if state.status != "running":
        return f"the run is {state.status}; only a running run can be paused"
    left = {"left_at": event.t, "left_level": made_level(plan, state, event.t)}
    state, records = close_window(plan, state, event.t, "pause")
    return state.model_copy(update={"status": "paused", **left}), (*records, Paused(t=event.t, why=event.why))


def interrupt(plan: TaskPlan, state: RunState, event: Interrupted) -> Outcome:
    """Restore a run after a restart of the program.

    The time between is unknown: the open window ends at the last known time. The machine carries nothing now.
    """
    state, records = close_window(plan, state, state.t, "interruption")
    new = {"t": event.t, "epoch": state.epoch + 1, "left_at": event.t, "left_level": EARTH, "is_feed_lost": False,
           "origin": event.t - plan.timeline.duration_s}  # fmt: skip  # no rest of the former clock goes on
    state = state.model_copy(update=new)
    if state.status not in ("running", "paused"):
        return state, records
    paused = Paused(t=event.t, why="the program was interrupted")
    return state.model_copy(update={"status": "paused"}), (*records, paused)


def resume(plan: TaskPlan, state: RunState, event: Resume) -> Outcome:
    """Continue with a window after a notice, and not before the level has reached 1.

    A pause does not shorten the protocol's rest before the next window, unless the operator names a window. A run whose
    windows are all complete ends instead.
    """
    if state.status != "paused":
        return f"the run is {state.status}; only a paused run can be resumed"
    window = state.next_window(plan.protocol.windows.numbers) if event.window is None else event.window
    if window is None:
        # The run was paused or interrupted after its last window. Nothing is left to wait for.
        return end(plan, state, event.t, "")
    if window not in plan.protocol.windows.numbers:
        numbers = plan.protocol.windows.numbers
        return f"there is no window {window} to resume at; windows are {numbers[0]} to {numbers[-1]}"
    arrives = state.left_at + slewing_s(state.left_level, EARTH)
    approach_s = plan.timeline.approach_s(window)
    approach = max(event.t + RESUME_NOTICE_S, arrives)
    if plan.is_clocked and event.window is None:
        approach = max(approach, state.origin + approach_s)
    changes = {
        "status": "running",
        "origin": approach - approach_s,
        "approach": approach,
        "phase": plan.timeline.index_at(approach_s) - 1,
        "wanted": None if plan.is_clocked else event.window,
    }
    return state.model_copy(update=changes), (Resumed(t=event.t, window=window, approach_t=approach),)


def stop(plan: TaskPlan, state: RunState, event: Stop) -> Outcome:
    """End the run; the level goes to 1."""
    if state.status in ("stopped", "finished"):
        return state, ()
    state, records = close_window(plan, state, event.t, "stop")
    state, more = end(plan, state, event.t, event.why or "stopped")
    return state, (*records, *more)


def raise_alarm(state: RunState, text: Sentence) -> Step:
    """Add an alarm for the operator."""
    number = len(state.alarms)
    alarm = RunAlarm(number=number, t=state.t, text=text)
    record: Record = AlarmRaised(t=state.t, alarm=number, text=text)
    return state.model_copy(update={"alarms": (*state.alarms, alarm)}), (record,)


def known_alarms(plan: TaskPlan, state: RunState) -> RunState:
    """Return the state with codes for alarms that were read from a file as text."""
    numbers = plan.protocol.windows.numbers
    said = [say(SENTENCES, "aircraft.contradicted"), say(SENTENCES, "aircraft.lost")]
    said += [say(SENTENCES, "aircraft.lost_in_window", window=number) for number in numbers]
    coded = {str(text): text for text in said}
    alarms = tuple(alarm.model_copy(update={"text": coded.get(alarm.text, alarm.text)}) for alarm in state.alarms)
    return state.model_copy(update={"alarms": alarms})


OPERATING: dict[type, Callable[[TaskPlan, RunState, Any], Outcome]] = {
    Start: start,
    OpenWindow: open_next,
    CloseWindow: close_open,
    FeedLost: lose_feed,
    FeedBack: hear_feed,
    Pause: pause,
    Resume: resume,
    Interrupted: interrupt,
    Stop: stop,
}
"""Handlers by type of event. Ticks, touches and returns of the hand are not among them."""
