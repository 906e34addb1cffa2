"""Messages that are written and read field by field; they define fields of the table of channels."""

from dataclasses import dataclass, field
from typing import Annotated

from exograv.results import OPTIONAL


@dataclass(frozen=True)
class TimingMessage:
    """Message of `/timing`: punctuality of a live run."""

    t: float
    periods: Annotated[int, "periods that passed, with a tick or without"]
    missed: Annotated[int, "periods that ended without their own command"]
    edges_us: Annotated[
        list[int | float], "bins of lateness, one edge more than counts; the last takes all above", "µs"
    ]
    counts: Annotated[list[int], "ticks by lateness"]
    longest_gap_us: Annotated[float | None, "longest time between a command and the next", "µs"]
    granted: Annotated[list[str], "real-time rights that the system granted"]
    refused: Annotated[list[str], "real-time rights that the system refused, and what to do"]
    ticks_lost: Annotated[int | None, "ticks that found the recorder's ring full"] = None
    recorder_restarts: Annotated[int | None, "number of restarts of the recorder"] = None


@dataclass(frozen=True)
class StreamNote:
    """Message of `/stream`: event of another device's stream."""

    monotonic: Annotated[float, "CLOCK_MONOTONIC when it was noticed", "s"]
    topic: Annotated[str, "channel of its samples"]
    kind: Annotated[
        str,
        "`connected`, `lost` (its source is gone), `silent` (its source is there, and sends no samples), `resumed`, "
        "`left out` (a text that is too long)",
    ]
    text: Annotated[str, "a sentence"]
    connection: Annotated[int, "number from 1; each connection may have another clock"]
    xml: Annotated[str | None, "of `connected`: the stream's own description, unchanged"] = field(
        default=None, metadata=OPTIONAL
    )


@dataclass(frozen=True)
class ClockCorrection:
    """Message of `/correction`: clock correction measured by LSL."""

    topic: Annotated[str, "channel of the stream's samples"]
    connection: Annotated[int, "as in `/stream`"]
    asked: Annotated[float, "CLOCK_MONOTONIC before the request", "s"]
    answered: Annotated[float, "CLOCK_MONOTONIC after the answer", "s"]
    offset: Annotated[float, "value that, added to a stamp, gives CLOCK_MONOTONIC", "s"]
    remote: Annotated[float, "time on the device's clock of LSL's measurement", "s"]
    uncertainty: Annotated[float, "LSL's own bound: round-trip time of the best probe", "s"]
