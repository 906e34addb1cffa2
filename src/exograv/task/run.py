"""Run of a protocol: events in, records out. The result depends only on state, events and the times in them."""

from collections.abc import Callable, Sequence
from typing import Any

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.model.description import validation_sentences

from .events import AcknowledgeAlarm, Distance, Event, Return, Touch
from .operator_events import OPERATING, known_alarms
from .plan import TaskPlan
from .pointing import returned
from .record_sinks import RecordSink
from .records import AlarmAcknowledged, Record, RefusedEvent
from .state import RunState
from .timed_transitions import Step, advanced, made_level
from .totals import Totals, totals
from .touch_judgement import judge


class TaskRun:
    """Session of one person. Its state can be stored, and the run can be restored from it."""

    def __init__(self, plan: TaskPlan, state: RunState | None = None, sinks: Sequence[RecordSink] = ()):
        """Begin a run, or continue one from its stored state (feed `Interrupted` if the program was restarted).

        Args:
            plan: Protocol, machine and screen.
            state: Stored state; a new run where absent.
            sinks: Each takes the records of every event, in this order.
        """
        self.plan, self.state, self.sinks = plan, state or RunState(), tuple(sinks)

    def feed(self, event: Event) -> tuple[Record, ...]:
        """Process one event and hand its records to all sinks."""
        self.state, records = step(self.plan, self.state, event)
        for sink in self.sinks:
            sink(event.t, records)
        return records

    def is_over(self, t: float) -> bool:
        """Return True if all windows are complete and the time after the last one has passed at `t` [s]."""
        if not self.state.complete >= set(self.plan.protocol.windows.numbers):
            return False
        closed = self.state.windows[-1].closed
        return closed is not None and t >= closed + self.plan.protocol.after_last_s

    def made_level(self, t: float) -> float:
        """Gravity level that the task requests from the machine at `t`, which is not before the last event [-]."""
        return made_level(self.plan, self.state, t)

    def totals(self) -> Totals:
        """Summary of all touches up to now."""
        return totals(self.state)

    def kept(self) -> str:
        """State of the run as JSON, for the checkpoint."""
        return self.state.model_dump_json()

    @classmethod
    def from_kept(cls, plan: TaskPlan, text: str) -> "TaskRun":
        """Restore a run from its stored state.

        Raises:
            ConfigError: The text is not a valid state, or its protocol is another one.
        """
        try:
            state = RunState.model_validate_json(text)
        except ValidationError as error:
            raise ConfigError(
                f"The stored state of the run is not valid: {validation_sentences(error)} Start a new run."
            ) from error
        if state.protocol_sha256 not in ("", plan.loaded.sha256) or state.phase >= len(plan.timeline.phases):
            raise ConfigError(
                f"The stored state is from another protocol than '{plan.protocol.name}', or from another version of "
                "its "
                "file. Give the file with which the run was started."
            )
        return cls(plan, known_alarms(plan, state))


def step(plan: TaskPlan, state: RunState, event: Event) -> Step:
    """Return state and records after an event. Transitions by the clock up to the event come first."""
    operating: Callable[[TaskPlan, RunState, Any], Step | str] | None = OPERATING.get(type(event))
    # After a restart of the program the time between is unknown, and the clock may be another one.
    if event.kind == "interrupted" and operating is not None:
        return _taken(operating(plan, state, event), state, event)
    t = event.received if isinstance(event, Touch) else event.t
    state, before = advanced(plan, state, t)
    if operating is not None and state.status != "ready":
        event = event.model_copy(update={"t": state.t})  # A delayed command counts from now.
    state, records = _respond(plan, state, event, operating)
    state, after = advanced(plan, state, t)
    return state, (*before, *records, *after)


def _respond(
    plan: TaskPlan, state: RunState, event: Event, operating: Callable[[TaskPlan, RunState, Any], Step | str] | None
) -> Step:
    if isinstance(event, Touch):
        return judge(plan, state, event)
    if isinstance(event, (Return, Distance)):
        return _note_return(plan, state, event)
    if isinstance(event, AcknowledgeAlarm):
        return _acknowledge(state, event)
    return (state, ()) if operating is None else _taken(operating(plan, state, event), state, event)


def _taken(outcome: Step | str, state: RunState, event: Event) -> Step:
    """Return the step of an operator's event. A sentence means that the event is refused."""
    if isinstance(outcome, str):
        return state, (RefusedEvent(t=state.t, event=event.kind, why=outcome),)
    return outcome


def _note_return(plan: TaskPlan, state: RunState, event: Return | Distance) -> Step:
    index = state.window_at(event.t)
    if index is None:
        return state, ()
    return state.with_window(index, cycle=returned(plan.protocol, state.windows[index].cycle, event)), ()


def _acknowledge(state: RunState, event: AcknowledgeAlarm) -> Step:
    open_ones = [alarm.number for alarm in state.alarms if not alarm.is_acknowledged]
    if event.alarm not in open_ones:
        return _taken(f"no alarm {event.alarm} waits to be acknowledged", state, event)
    alarms = (
        alarm.model_copy(update={"is_acknowledged": True}) if alarm.number == event.alarm else alarm
        for alarm in state.alarms
    )
    record = AlarmAcknowledged(t=state.t, alarm=event.alarm)
    return state.model_copy(update={"alarms": tuple(alarms)}), (record,)
