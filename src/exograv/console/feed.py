"""Data of the aircraft in the console: its g opens and closes the windows of a trial, and the pages show it."""

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
    """Receiver for the aircraft of this protocol. It opens its socket when its `with` block begins.

    Raises:
        ConfigError: The protocol has no windows that an aircraft opens, or port or sender cannot be used.
    """
    if plan is None or plan.protocol.opening != "aircraft":
        raise ConfigError(
            "--aircraft needs a protocol whose windows an aircraft opens. Give --protocol flight, or a protocol of "
            "your own with opening = 'aircraft'."
        )
    if not 0 <= port <= 65535:
        raise ConfigError(f"--aircraft is {port}; allowed: a UDP port from 1 to 65535, or 0 for a free one.")
    windows = plan.protocol.windows
    return AircraftReceiver(plan.protocol.aircraft, windows.level_of(windows.first_number).start, port, sender)


class Feed:
    """Connection between the receiver of the aircraft's data and the trial."""

    def __init__(self, receiver: AircraftReceiver, trial: ProtocolTrial, diary: EventLog):
        """Listen to `receiver`, which is open."""
        self._receiver, self._trial = receiver, trial
        self._heard_at: float | None = None
        self._missed = False

        write = aircraft_sink(diary)

        def told(t: float, sample: AircraftSample) -> None:
            self._heard_at = t
            write(t, sample)

        receiver.told = told

    @property
    def port(self) -> int:
        """UDP port in use."""
        return self._receiver.port

    def step(self, t: float) -> str:
        """Pass on the data until `t` [s]; return a sentence for an alarm if none ever came."""
        for event in self._receiver.receive(t):
            self._trial.run.feed(event)
        is_missed = self._heard_at is None and self._trial.is_running
        was_missed, self._missed = self._missed, is_missed
        return say("aircraft.not_heard") if is_missed and not was_missed else ""

    def shown(self, t: float) -> dict[str, Any]:
        """Return the state of the feed for the operator's page."""
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
