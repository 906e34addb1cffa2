"""Channels of sessions in which a participant does a task."""

from .fields import Channel, Field, T

TASK = Channel(
    "/task",
    "json",
    "when it happens, sessions with a participant's task only",
    "What the run of a protocol says: phases, windows, touches, pace, pauses, alarms; also what went out as a marker.",
    (
        T,
        Field("kind", "string", "-", "`run_began`, `phase_began`, `window_opened`, `touch`, `pace_changed` …"),
        Field(
            "record",
            "object",
            "-",
            "the whole record (docs/explanation/task.md); at a console its own times are the computer's",
        ),
    ),
)

AIRCRAFT = Channel(
    "/aircraft",
    "json",
    "about 10 Hz, flights only",
    "What the aircraft's own feed said.",
    (
        T,
        Field("g", "number", "-", "acceleration over that on Earth along the aircraft's axes", (3,)),
        Field("parabola", "integer", "-", "as the aircraft counts"),
        Field("announcement", "string", "-", "its text"),
    ),
)
