"""Datagrams to the simulated amplifier: pulses of the panel, and the torque of the wearer's muscles.

Times are of CLOCK_BOOTTIME, which a replaced CLOCK_MONOTONIC of the amplifier's process does not change.
"""

import json
import socket
import time
from collections.abc import Sequence

BYTES_MAX = 2048


def true_time() -> float:
    """Return CLOCK_BOOTTIME [s]."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class ToAmplifier:
    """Sender of pulses and torques to an amplifier on this computer. It never waits."""

    def __init__(self, port: int):
        """Send to this UDP port."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._address = ("127.0.0.1", port)

    def pulse(self) -> None:
        """Send a pulse of this moment."""
        self._send({"pulse": true_time()})

    def torque(self, torque_Nm: Sequence[float]) -> None:
        """Send the torque of the muscles [N·m]."""
        self._send({"torque_Nm": list(torque_Nm)})

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _send(self, message: dict[str, float | list[float]]) -> None:
        try:
            self._socket.sendto(json.dumps(message).encode(), self._address)
        except OSError:
            return  # The amplifier is off, or its buffer is full: electrodes must not stop a session.
