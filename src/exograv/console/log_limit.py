"""Rate limit of the server's log: a flood of wrong requests must not fill a terminal or a disk."""

import contextlib
import logging
import time
from collections.abc import Callable, Iterator

LOGGERS = ("uvicorn", "uvicorn.error", "uvicorn.asgi", "asyncio", "websockets", "websockets.server")
"""Loggers of the server's packages."""

MESSAGES_MAX, PERIOD_S = 10, 10.0
"""Largest number of messages of all loggers in this time [s]."""


class LogLimit(logging.Filter):
    """Filter that leaves out messages beyond the limit, and says how many they were."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """Count on this clock [s]."""
        super().__init__()
        self._clock, self._begun, self._count = clock, clock(), 0

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True if the message is within the limit."""
        now = self._clock()
        if now - self._begun >= PERIOD_S:
            left_out, self._begun, self._count = self._count - MESSAGES_MAX, now, 0
            if left_out > 0:
                record.msg = f"{record.getMessage()} ({left_out} messages before this one were left out.)"
                record.args = None
        self._count += 1
        return self._count <= MESSAGES_MAX


@contextlib.contextmanager
def limited_logs() -> Iterator[None]:
    """Limit the log of the server's packages within the block."""
    limit = LogLimit()
    loggers = [logging.getLogger(name) for name in LOGGERS]
    for logger in loggers:
        logger.addFilter(limit)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(limit)
