"""Recorded and shown points of the arms, from the line that the controller draws."""

from collections.abc import Sequence

POINTS = 4
"""Points of an arm: shoulder, elbow, wrist, finger tip."""


def arms_of_line(line: Sequence[Sequence[float]]) -> list[list[Sequence[float]]]:
    """Split the controller's line into arms, the right one first; no arms if the line has another form.

    With two arms the line runs from the right hand over the shoulders to the left hand.
    """
    if len(line) == POINTS:
        return [list(line)]
    if len(line) == 2 * POINTS:
        return [list(reversed(line[:POINTS])), list(line[POINTS:])]
    return []
