"""Pointing cycle from rest to the target and back: accepted touches, reasons for rejection, and deviations."""

import enum
import math
from typing import NamedTuple

from exograv.model.rig_settings import Settings

from .events import Distance, Return, Touch
from .protocol_schema import Protocol
from .screen import ScreenCalibration

RETURNS_MAX = 64
"""Number of stored returns while touches are late. Each accepted touch removes the returns before it."""

RETURN_EVERY_S = 0.2
"""Shortest time between two stored returns [s]."""

AHEAD_MAX_S = 0.1
"""Largest amount by which a touch may seem later than its arrival, from the error of the fitted clock [s]."""


class RejectionReason(enum.Enum):
    """Reason why a touch is rejected. The value is the word in records."""

    REPEATED = "repeated"
    UNTIMED = "untimed"
    OUTSIDE = "outside"
    POINTER = "pointer"
    SECOND = "second"
    PALM = "palm"
    OFF_TARGET = "off_target"
    BOUNCE = "bounce"
    NO_RETURN = "no_return"

    @property
    def sentence(self) -> str:
        """Reason as a sentence for the operator."""
        return SENTENCES[self]


SENTENCES = {
    RejectionReason.REPEATED: "The touch was sent again and is already counted.",
    RejectionReason.UNTIMED: "The touch is later than its arrival: the page's clock is not fitted.",
    RejectionReason.OUTSIDE: "The touch is outside of every window.",
    RejectionReason.POINTER: "This protocol does not take this kind of pointer.",
    RejectionReason.SECOND: "The touch is a second finger.",
    RejectionReason.PALM: "The contact is too large: a palm.",
    RejectionReason.OFF_TARGET: "The touch is too far from the target to be meant for it.",
    RejectionReason.BOUNCE: "The touch follows the last one too soon to be a new one.",
    RejectionReason.NO_RETURN: "The hand did not return to its resting place.",
}


class PointingCycle(Settings):
    """State of the hand's cycle in one window. The cycle begins at rest."""

    last_touch: float | None = None
    """Time of the last accepted touch [s]; None before the first."""

    returns: tuple[float, ...] = ()
    """Times at which the hand was back at rest since then."""


class Deviation(NamedTuple):
    """Contact minus target, right and down.

    Fields of `records.TouchRecord`; those in mm are None without calibration.
    """

    deviation_x_px: float
    deviation_y_px: float
    deviation_px: float
    deviation_x_mm: float | None = None
    deviation_y_mm: float | None = None
    deviation_mm: float | None = None


def deviation(touch: Touch, screen: ScreenCalibration | None) -> Deviation:
    """Deviation of a touch from its target."""
    dx, dy = touch.x_px - touch.target_x_px, touch.y_px - touch.target_y_px
    off = Deviation(dx, dy, math.hypot(dx, dy))
    if screen is None:
        return off
    x_mm, y_mm = screen.to_mm(dx, dy)
    return off._replace(deviation_x_mm=x_mm, deviation_y_mm=y_mm, deviation_mm=math.hypot(x_mm, y_mm))


def unfit(protocol: Protocol, screen: ScreenCalibration | None, touch: Touch) -> RejectionReason | None:
    """Reason why this contact cannot be pointing; None if it can."""
    rules = protocol.pointing
    if touch.pointer not in rules.pointers:
        return RejectionReason.POINTER
    if not touch.is_primary:
        return RejectionReason.SECOND
    largest_px = rules.contact_max_px
    if screen is not None:
        largest_px = rules.contact_max_mm / max(screen.pitch_x_mm, screen.pitch_y_mm)
    if touch.contact_px > largest_px:
        return RejectionReason.PALM
    return RejectionReason.OFF_TARGET if deviation(touch, screen).deviation_px > rules.area_radius_px else None


def too_soon(protocol: Protocol, cycle: PointingCycle, t: float) -> RejectionReason | None:
    """Reason why a touch at `t` is not the next one of the cycle; None if it is."""
    if cycle.last_touch is None:
        return None
    since_s, rules = t - cycle.last_touch, protocol.pointing
    if since_s < rules.bounce_s:
        return RejectionReason.BOUNCE
    if rules.return_check == "time":
        return RejectionReason.NO_RETURN if since_s < rules.return_after_s else None
    return None if any(cycle.last_touch < back <= t for back in cycle.returns) else RejectionReason.NO_RETURN


def touched(cycle: PointingCycle, t: float) -> PointingCycle:
    """Return the pointing cycle after an accepted touch."""
    return PointingCycle(last_touch=t, returns=tuple(back for back in cycle.returns if back > t))


def returned(protocol: Protocol, cycle: PointingCycle, event: Return | Distance) -> PointingCycle:
    """Cycle after an event of sensor or machine; unchanged if the event does not mean that the hand is back."""
    rules = protocol.pointing
    if isinstance(event, Return):
        is_back = rules.return_check == "sensor"
    elif rules.return_check == "fingertip":
        is_back = event.fingertip_m is not None and 1e3 * event.fingertip_m <= rules.rest_radius_mm
    else:
        is_near = event.joints_rad is not None and math.degrees(event.joints_rad) <= rules.rest_radius_deg
        is_back = rules.return_check == "joints" and is_near
    if not is_back:
        return cycle
    # A resting hand gives an event at every tick of the loop.
    if cycle.returns and 0.0 <= event.t - cycle.returns[-1] < RETURN_EVERY_S:
        return cycle
    return cycle.model_copy(update={"returns": (*cycle.returns, event.t)[-RETURNS_MAX:]})
