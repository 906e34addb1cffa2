"""Limits on the messages of a page, and close codes of a line."""

import enum
from collections import deque

from .keys import Role

MESSAGE_MAX_BYTES = 16 * 1024
"""Longest message. The longest regular message, thirty touches after a lost connection, has half of this."""

DEPTH_MAX = 8
"""Largest depth of brackets in a message."""

MESSAGES_PER_S = 50
"""Largest rate of messages per line. The participant's page sends most: about ten pings, touches and trails."""

CLIENTS_MAX = 8
"""Largest number of open lines."""

LINES_RESERVED = {Role.OPERATOR: 2, Role.THERAPIST: 1, Role.PARTICIPANT: 2}
"""Number of lines that only this role may open. One page has one line, and a second one while it reconnects."""

HELLO_S = 2.0
"""Time-out for the first message of a line [s]."""

BODY_MAX_BYTES = 4 * 1024
"""Longest body of a POST. A token has 43 bytes."""


class Close(enum.IntEnum):
    """Reason for which the server closes a line: codes of RFC 6455, and one code of the range for applications."""

    GOING_AWAY = 1001
    PROTOCOL = 1002
    POLICY = 1008
    TOO_BIG = 1009
    BUSY = 1013
    UNAUTHORISED = 4401


class Rate:
    """Rate limit of one line: messages in the last second."""

    def __init__(self, most: int = MESSAGES_PER_S):
        """Allow `most` messages per second."""
        self._times = deque[float](maxlen=most)

    def allows(self, t: float) -> bool:
        """Count a message at `t` [s]; return False if it exceeds the limit."""
        if len(self._times) == self._times.maxlen and t - self._times[0] < 1.0:
            return False
        self._times.append(t)
        return True
