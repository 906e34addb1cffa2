"""Waiting for another process or thread: until a condition holds, not for a guessed time."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

POLL_S = 0.005
"""Time between two checks of the condition [s]: most checks are system calls or small reads."""

SOON_S = 30.0
"""Time limit for a condition that holds within a second on a quiet computer [s]."""


def wait_until(
    condition: Callable[[], T],
    what: str | Callable[[], object] = "the condition holds",
    seconds: float = SOON_S,
    every_s: float = POLL_S,
) -> T:
    """Check a condition until it is true and return its value.

    Args:
        condition: It may also act, for example keep a lease.
        what: Text of the failure, or a function that describes the state at the end.
        seconds: Time limit [s].
        every_s: Time between two checks [s].

    Raises:
        AssertionError: The condition did not become true in time.
    """
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, f"not within {seconds} s: {what() if callable(what) else what}"
        time.sleep(every_s)
    return value
