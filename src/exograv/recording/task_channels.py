"""Channels of sessions in which a participant does a task."""

from .fields import Channel, Field, T

TASK = Channel(
    "/task",
    "json",
    "when it happens, sessions with a participant's task only",
    "Records of a protocol's run: phases, windows, touches, pace, pauses, alarms, and markers that were sent.",
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
    "Data of the aircraft's own feed.",
    (
        T,
        Field("g", "number", "-", "acceleration along the aircraft's axes, divided by Earth's gravity", (3,)),
        Field("parabola", "integer", "-", "number of the parabola by the aircraft's count"),
        Field("announcement", "string", "-", "text of the announcement"),
    ),
)
