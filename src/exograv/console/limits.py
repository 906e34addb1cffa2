"""How much one page may send, and how a line to a page ends."""

import enum
from collections import deque

MESSAGE_MAX_BYTES = 16 * 1024
"""The longest honest message, thirty touches of a lost connection, has half of it."""

DEPTH_MAX = 8
"""Of brackets in a message."""

MESSAGES_PER_S = 50
"""The busiest page is the participant's: pings, touches and their trails are ten."""

CLIENTS_MAX = 8
"""Lines that are open at a time."""

HELLO_S = 2.0
"""In which the first message has to come [s]."""

BODY_MAX_BYTES = 4 * 1024
"""Of what is posted: a token has 43."""


class Close(enum.IntEnum):
    """Why the server ends a line; the numbers are those of RFC 6455, and one of the range for applications."""

    GOING_AWAY = 1001
    PROTOCOL = 1002
    POLICY = 1008
    TOO_BIG = 1009
    BUSY = 1013
    UNAUTHORISED = 4401


class Rate:
    """Messages of one line in the last second."""

    def __init__(self, most: int = MESSAGES_PER_S):
        """So many are allowed."""
        self._times = deque[float](maxlen=most)

    def allows(self, t: float) -> bool:
        """Whether one more is, at `t` [s]."""
        if len(self._times) == self._times.maxlen and t - self._times[0] < 1.0:
            return False
        self._times.append(t)
        return True
