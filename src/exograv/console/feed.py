"""The aircraft's data under the pages: its g opens and closes the windows of a trial, and pages see what it says."""

from typing import Any

from exograv.errors import ConfigError
from exograv.experiment.aircraft import AircraftReceiver
from exograv.task.aircraft_line import AircraftSample
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import aircraft_sink

from .event_log import EventLog
from .sentences import say
from .trial import ProtocolTrial


def receiver_of(plan: TaskPlan | None, port: int, sender: str | None) -> AircraftReceiver:
    """Of the aircraft that flies this protocol; nothing is heard before `with`.

    Raises:
        ConfigError: There is no such protocol, or port and sender cannot be used.
    """
    if plan is None or plan.protocol.opening != "aircraft":
        raise ConfigError(
            "--aircraft is given, and no protocol whose windows an aircraft opens. Give --protocol flight, or one of "
            "your own with opening = 'aircraft'."
        )
    if not 0 <= port <= 65535:
        raise ConfigError(f"--aircraft is {port}; allowed: a UDP port from 1 to 65535, or 0 for a free one.")
    windows = plan.protocol.windows
    return AircraftReceiver(plan.protocol.aircraft, windows.level_of(windows.first_number).start, port, sender)


class Feed:
    """Between receiver and trial."""

    def __init__(self, receiver: AircraftReceiver, trial: ProtocolTrial, diary: EventLog):
        """Listens; `receiver` is open."""
        self._receiver, self._trial = receiver, trial
        self._heard_at: float | None = None
        self._missed = False

        write = aircraft_sink(diary)

        def told(t: float, sample: AircraftSample) -> None:
            self._heard_at = t
            write(t, sample)

        receiver.told = told

    def step(self, t: float) -> str:
        """Take what has come until `t` [s]; a sentence for an alarm where nothing ever came."""
        for event in self._receiver.receive(t):
            self._trial.run.feed(event)
        is_missed = self._heard_at is None and self._trial.is_running
        was_missed, self._missed = self._missed, is_missed
        return say("aircraft.not_heard") if is_missed and not was_missed else ""

    def shown(self, t: float) -> dict[str, Any]:
        """For the operator."""
        receiver, sample = self._receiver, self._receiver.sample
        said = None
        if sample is not None:
            said = {"g": sample.norm_g, "parabola": sample.parabola, "announcement": sample.announcement}
        return {
            "port": receiver.port,
            "sample": said,
            "age_s": None if self._heard_at is None else max(t - self._heard_at, 0.0),
            "is_window": receiver.is_window,
            "is_lost": receiver.is_lost,
            "refused": receiver.refused,
            "foreign": receiver.foreign,
        }
