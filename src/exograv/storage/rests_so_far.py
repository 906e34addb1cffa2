"""Rests so far in a session that learns the arm in rests; the estimate itself is in the participant's file."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RestsSoFar:
    """Number and motion of the rests, from which the next part of the session counts on."""

    rests: int = 0
    """Number of motions. It gives the part of the excitation that the next rest moves."""
    left_out: int = 0
    """Number of restless motions that the estimate does not use."""
    motion_s: float = 0.0
    """Driven motion that the estimate uses [s]."""


NO_RESTS = RestsSoFar()
