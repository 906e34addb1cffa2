"""Pace: time since the last touch, judged as too short, right or too long."""

import enum

from .protocol_schema import Protocol
from .task_settings import Sign


class Pace(enum.Enum):
    """Judgement of the pace. The value is the word in records."""

    TOO_SHORT = "too_short"
    RIGHT = "right"
    TOO_LONG = "too_long"


def pace(protocol: Protocol, since_touch_s: float) -> Pace:
    """Pace for the time since the last accepted touch, or since the window opened [s]; right at both limits."""
    late_s = since_touch_s - protocol.windows.interval_s
    if abs(late_s) <= protocol.pace.tolerance_s:
        return Pace.RIGHT
    return Pace.TOO_SHORT if late_s < 0.0 else Pace.TOO_LONG


def pace_changes_s(protocol: Protocol) -> tuple[tuple[float, Pace], ...]:
    """Return the times after a touch at which the pace changes [s], and the new paces, if no touch follows."""
    interval_s, tolerance_s = protocol.windows.interval_s, protocol.pace.tolerance_s
    return (0.0, Pace.TOO_SHORT), (interval_s - tolerance_s, Pace.RIGHT), (interval_s + tolerance_s, Pace.TOO_LONG)


def arrow(protocol: Protocol, pace: Pace) -> Sign | None:
    """Sign shown for a pace; None if the protocol shows no pace, or if this pace has no sign."""
    sign = {
        Pace.TOO_SHORT: protocol.pace.too_short,
        Pace.RIGHT: protocol.pace.right,
        Pace.TOO_LONG: protocol.pace.too_long,
    }[pace]
    return sign if protocol.pace.shown and sign.shape != "none" else None
