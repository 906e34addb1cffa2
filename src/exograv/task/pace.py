"""The pace: whether the time since the last touch is too short, right, or too long."""

import enum

from .protocol_schema import Protocol
from .task_settings import Sign


class Pace(enum.Enum):
    """What is to be told; the value is the word in records."""

    TOO_SHORT = "too_short"
    RIGHT = "right"
    TOO_LONG = "too_long"


def pace(protocol: Protocol, since_touch_s: float) -> Pace:
    """Of the time since the last touch that counted, or since the window opened [s]; borders are right."""
    late_s = since_touch_s - protocol.windows.interval_s
    if abs(late_s) <= protocol.pace.tolerance_s:
        return Pace.RIGHT
    return Pace.TOO_SHORT if late_s < 0.0 else Pace.TOO_LONG


def pace_changes_s(protocol: Protocol) -> tuple[tuple[float, Pace], ...]:
    """When the pace changes after a touch that is followed by none [s], and to what."""
    interval_s, tolerance_s = protocol.windows.interval_s, protocol.pace.tolerance_s
    return (0.0, Pace.TOO_SHORT), (interval_s - tolerance_s, Pace.RIGHT), (interval_s + tolerance_s, Pace.TOO_LONG)


def arrow(protocol: Protocol, pace: Pace) -> Sign | None:
    """What is shown of it; None where the protocol shows no pace, or this one has no sign."""
    sign = {
        Pace.TOO_SHORT: protocol.pace.too_short,
        Pace.RIGHT: protocol.pace.right,
        Pace.TOO_LONG: protocol.pace.too_long,
    }[pace]
    return sign if protocol.pace.shown and sign.shape != "none" else None
