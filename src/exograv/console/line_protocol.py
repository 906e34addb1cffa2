"""Byte rate of one line, below its messages: control frames and the rest of a closed line cost time, too."""

import asyncio
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

BYTES_PER_S, BYTES_AT_ONCE = 64 * 1024, 128 * 1024
"""Rate and burst of a line [byte/s, byte]: seven messages of the largest size at once, then four in a second."""

AFTER_CLOSE_BYTES = 4 * 1024
"""Bytes that a page may still send after the server has closed the line: messages that were on their way."""

RECEIVE_BYTES = 8 * 1024
"""Receive buffer of a connection. A page that floods its line then gives the event loop little work at a time."""


class LineProtocol(WebSocketsSansIOProtocol):
    """WebSocket connection that ends at once when it sends too many bytes."""

    def __init__(self, *values: Any, **named: Any):
        """Begin with a full budget; the arguments are those of uvicorn."""
        super().__init__(*values, **named)
        self._budget, self._counted_at, self._after_close = float(BYTES_AT_ONCE), asyncio.get_running_loop().time(), 0

    def data_received(self, data: bytes) -> None:
        """Take bytes within the budget; abort the connection beyond it."""
        now = asyncio.get_running_loop().time()
        self._budget = min(self._budget + BYTES_PER_S * (now - self._counted_at), BYTES_AT_ONCE) - len(data)
        self._counted_at = now
        self._after_close += len(data) if self.close_sent else 0
        if self._budget < 0.0 or self._after_close > AFTER_CLOSE_BYTES:
            self.transport.abort()
        else:
            super().data_received(data)
