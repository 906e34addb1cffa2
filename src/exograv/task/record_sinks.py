"""Destinations of a run's records: recording, marker stream, checkpoint. Every sink has the same signature."""

import json
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from .aircraft_line import AircraftSample
from .records import Record, marker

CHECKPOINT_EVERY_S = 10.0
"""Longest time between two checkpoints while nothing happens [s]."""

TASK_TOPIC, AIRCRAFT_TOPIC = "/task", "/aircraft"

RecordSink = Callable[[float, tuple[Record, ...]], None]
"""Callback that receives the time of an event [s] and its records in order. There may be no record."""


@runtime_checkable
class MessageWriter(Protocol):
    """Stores messages by topic and time: a recording, or the event log of a console."""

    def write(self, topic: str, t: float, message: Mapping[str, Any], /) -> None:
        """Store one message of time `t` [s]."""
        ...


def task_message(record: Record) -> dict[str, object]:
    """Message of a record on the channel `/task` of a recording."""
    return {"kind": record.kind, "record": json.loads(marker(record))}


def recording_sink(writer: MessageWriter) -> RecordSink:
    """Sink that writes every record to a recording."""

    def take(_t: float, records: tuple[Record, ...]) -> None:
        for record in records:
            writer.write(TASK_TOPIC, record.t, task_message(record))

    return take


def marker_sink(push: Callable[[list[str]], object]) -> RecordSink:
    """Sink that sends every record as a marker of Lab Streaming Layer."""

    def take(_t: float, records: tuple[Record, ...]) -> None:
        for record in records:
            push([marker(record)])

    return take


def checkpoint_sink(keep: Callable[[float], None]) -> RecordSink:
    """Sink that calls `keep` after every record, and at least every `CHECKPOINT_EVERY_S`."""
    kept_at = -float("inf")

    def take(t: float, records: tuple[Record, ...]) -> None:
        nonlocal kept_at
        if records or t - kept_at > CHECKPOINT_EVERY_S:
            kept_at = t
            keep(t)

    return take


def aircraft_sink(writer: MessageWriter) -> Callable[[float, AircraftSample], None]:
    """Return a function that writes every sample of the aircraft."""
    return lambda t, sample: writer.write(AIRCRAFT_TOPIC, t, sample.message)
