"""Grip on a guided arm: comes by a ramp, and fades when the person holds against the guidance."""

import enum

GRIP_S = 2.0
"""Time in which the pull rises from zero to its full strength [s]."""

GIVE_S = 2.0
"""Time in which the pull fades while the person holds against it [s]."""

DROP_S = 0.2
"""Time in which the pull fades when the person has moved away, or asks for release [s]."""

FREE = 0.4
"""Strain up to which the path keeps its speed. Strain is the largest error over the pull's reach [-]."""

HELD = 0.85
"""Strain from which the person holds against the guidance [-]. It is below 1, which a path that slows down hardly
reaches."""

AWAY = 2.5
"""Strain at which the person has moved away from the path [-]."""


class GripOutcome(enum.Enum):
    """Outcome of a guided arm; the value is a sentence for the operator."""

    FREE = "The arm floats without guidance."
    LED = "The arm is led."
    ARRIVED = "The path is at its end."
    OVERRULED = "The person held against the guidance, and the arm was released."
    RELEASED = "The arm was released on request."
    ENDED = "The time was over, and the arm was released."
    RUSHED = "The leading arm moved with a jerk, and the following arm was released."
    LOST = "The following arm was too far behind, and was released."


def pace(strain: float) -> float:
    """Share of its speed with which a path or leading arm proceeds at a strain: 1 up to `FREE`, 0 from 1 on."""
    return min(1.0, max(0.0, (1.0 - strain) / (1.0 - FREE)))


def next_grip(grip: float, state: GripOutcome, strain: float, dt: float) -> tuple[float, GripOutcome]:
    """Return grip and state after a tick of `dt` [s]. The grip is the share of the pull that acts, from 0 to 1."""
    if state not in (GripOutcome.LED, GripOutcome.ARRIVED):
        return max(grip - dt / DROP_S, 0.0), state
    if strain >= AWAY:
        return grip, GripOutcome.OVERRULED
    if strain >= HELD:
        grip = max(grip - dt / GIVE_S, 0.0)
        return grip, GripOutcome.OVERRULED if grip == 0.0 else state
    return min(grip + dt / GRIP_S, 1.0), state
