"""Datagrams to the simulated amplifier: pulses of the panel, and the torque of the wearer's muscles.

Times are of CLOCK_BOOTTIME, which a replaced CLOCK_MONOTONIC of the amplifier's process does not change.
"""

import socket
import time
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, TypeAdapter

from exograv.model.rig_settings import Settings

BYTES_MAX = 2048
"""Longest datagram: a torque for 32 freedoms has less than 1000 bytes."""


def true_time() -> float:
    """Return the time of CLOCK_BOOTTIME [s], which is true in each process of this computer."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class Pulse(Settings):
    """Pulse of the panel, such as a trigger box gives."""

    kind: Literal["pulse"] = "pulse"
    t: FiniteFloat
    """Time of CLOCK_BOOTTIME [s]."""


class Effort(Settings):
    """Torque of the wearer's muscles."""

    kind: Literal["effort"] = "effort"
    torque_Nm: tuple[FiniteFloat, ...]
    """Torque by freedom of the arm [N·m]."""


TO_AMPLIFIER: TypeAdapter[Pulse | Effort] = TypeAdapter(Annotated[Pulse | Effort, Field(discriminator="kind")])
"""Reader of a datagram."""


class ToAmplifier:
    """Sender of pulses and torques to an amplifier on this computer. It never waits."""

    def __init__(self, port: int):
        """Send to this UDP port."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._address = ("127.0.0.1", port)

    def pulse(self) -> None:
        """Send a pulse of this moment."""
        self._send(Pulse(t=true_time()))

    def torque(self, torque_Nm: Sequence[float]) -> None:
        """Send the torque of the muscles [N·m]."""
        self._send(Effort(torque_Nm=tuple(torque_Nm)))

    def close(self) -> None:
        """Close the line to the amplifier; nothing can be sent any more."""
        self._socket.close()

    def _send(self, message: Pulse | Effort) -> None:
        try:
            self._socket.sendto(message.model_dump_json().encode(), self._address)
        except OSError:
            return  # The amplifier is off, or its buffer is full: electrodes must not stop a session.
