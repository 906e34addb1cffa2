"""How firmly an arm is held: the grip comes by a ramp, and gives way to whoever holds against it."""

import enum

GRIP_S = 2.0
"""In which the pull comes, from nothing to all of it."""

GIVE_S = 2.0
"""In which it goes while somebody holds against it."""

DROP_S = 0.2
"""In which it goes when the person has gone elsewhere, or wants it to."""

FREE = 0.4
"""Strain, the largest error over the pull's reach, up to which nothing waits for the arm."""

HELD = 0.85
"""Strain from which on somebody holds against it: below 1, which a path that slows down never quite reaches."""

AWAY = 2.5
"""Strain at which the person has gone elsewhere."""


class GripOutcome(enum.Enum):
    """Of an arm; the value is a sentence for the operator."""

    FREE = "The arm floats; nothing leads it."
    LED = "The arm is led."
    ARRIVED = "The path is at its end."
    OVERRULED = "The person held against what leads the arm, and was let go."
    RELEASED = "The arm was let go when somebody asked for it."
    ENDED = "The time was over, and the arm was let go."
    RUSHED = "The leading arm was jerked, and the other was let go."
    LOST = "The following arm was left too far behind, and was let go."


def pace(strain: float) -> float:
    """Share of its speed with which what leads goes on at a strain: 1 up to `FREE`, 0 at 1 and beyond."""
    return min(1.0, max(0.0, (1.0 - strain) / (1.0 - FREE)))


def next_grip(grip: float, state: GripOutcome, strain: float, dt: float) -> tuple[float, GripOutcome]:
    """Grip, a share, and state after a tick of `dt` [s]."""
    if state not in (GripOutcome.LED, GripOutcome.ARRIVED):
        return max(grip - dt / DROP_S, 0.0), state
    if strain >= AWAY:
        return grip, GripOutcome.OVERRULED
    if strain >= HELD:
        grip = max(grip - dt / GIVE_S, 0.0)
        return grip, GripOutcome.OVERRULED if grip == 0.0 else state
    return min(grip + dt / GRIP_S, 1.0), state
