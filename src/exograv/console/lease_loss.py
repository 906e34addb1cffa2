"""Reason why a page lost the right to steer, with what to do next.

The server first says what it saw: a closed line, silence, or its own delay. A page that comes back knows more: its
browser was too slow, it was in the background, or its computer slept.
"""

from dataclasses import dataclass
from typing import Literal

from exograv.sentence import Sentence

from .lease import LEASE_S
from .sentences import say

Cause = Literal["closed", "refused", "silent", "hidden", "slow", "asleep", "server_slow"]
"""Cause of a loss; each has a sentence `lease.…`, and the participant's page has one in simple words."""

SERVER_SLOW_S = 0.5 * LEASE_S
"""Delay of the server's own loop from which the server is the cause of a silence [s]."""


@dataclass(frozen=True)
class LeaseLoss:
    """Loss of the lease by one page."""

    line: int
    """Number of the line that steered."""

    page: str
    """Opening of the page, which stays the same when the page connects again."""

    cause: Cause
    seconds: float
    """Duration of the silence, or of the gap that the page measured [s]."""

    @property
    def text(self) -> Sentence:
        """Sentence for operator and therapist: the cause, and what to do next."""
        return say(f"lease.{self.cause}", line=self.line, seconds=f"{self.seconds:.1f}")


def cause_of_silence(is_hidden: bool, server_late_s: float) -> Cause:
    """Return the cause of a silence, as far as the server can tell.

    Args:
        is_hidden: True if the page's last heartbeat said that it was in the background.
        server_late_s: Longest delay of the server's own loop in the silence [s].
    """
    if server_late_s > SERVER_SLOW_S:
        return "server_slow"
    return "hidden" if is_hidden else "silent"
