"""Frames of a CAN bus through python-can, without our own."""

import importlib.util
import secrets
import time
from collections import Counter
from typing import Any, NamedTuple

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.settings import CanopenBus

ECHOING = ("udp_multicast",)
"""Adapters that also receive the frames that this host sends. There, sent frames carry a mark."""


def require_can() -> None:
    """Check that the packages for CAN are installed.

    Raises:
        ConfigError: A package is missing.
    """
    missing = [name for name in ("can", "canopen") if importlib.util.find_spec(name) is None]
    if missing:
        raise ConfigError("Drives on a CAN bus need python-can and canopen: pip install exograv[can].")


class CanFrame(NamedTuple):
    """CAN frame with eleven-bit number and data."""

    cob: int
    data: bytes


NO_FRAME = CanFrame(-1, b"")
"""Frame without a meaning here: our own, an error frame, a remote frame, one with a 29-bit number, or a broken one."""


class Bus:
    """Adapter of a CAN bus. Failures in the loop are counted and look like silence; no exception is raised there."""

    def __init__(self, settings: CanopenBus):
        """Open the adapter.

        Raises:
            ConfigError: python-can is missing, or does not know the adapter.
            RigError: The adapter does not open.
        """
        require_can()
        import can

        self._message, self._error = can.Message, can.CanError
        self._mark = secrets.token_hex(4) if settings.interface in ECHOING else None
        try:
            self.adapter = can.Bus(interface=settings.interface, ignore_config=True, **_options(settings))
        except NotImplementedError as error:
            raise ConfigError(
                f"canopen.interface '{settings.interface}' cannot be used: {error}. Adapters: "
                f"{', '.join(sorted(can.VALID_INTERFACES))}; some need a package of their maker."
            ) from error
        except (can.CanError, OSError, ValueError) as error:
            raise RigError(
                f"The CAN adapter '{settings.interface}' does not open '{settings.channel}': {error}. Is it plugged "
                "in, its driver loaded and the link up (`ip link set can0 up type can bitrate 1000000`)?"
            ) from error
        self.counts: Counter[str] = Counter()
        """Number of frames that the adapter could not send or receive."""

    def send(self, cob: int, data: bytes) -> None:
        """Send one frame. A full or disconnected adapter loses the frame; missing answers then show the loss."""
        message = self._message(arbitration_id=cob, data=data, is_extended_id=False, channel=self._mark)
        try:
            self.adapter.send(message)
        except (self._error, OSError):
            self.counts["not sent"] += 1

    def receive(self, until: float) -> CanFrame | None:
        """Return the next frame, waiting or arriving before `until` on `time.monotonic`; None if there is none.

        Each call takes at most one frame from the adapter, so that a caller can bound their number (`NO_FRAME`).
        """
        try:
            message = self.adapter.recv(max(until - time.monotonic(), 0.0))
        except (self._error, OSError):
            self.counts["not heard"] += 1
            return NO_FRAME if time.monotonic() < until else None
        if message is None:
            return None
        return NO_FRAME if self._is_ours_or_none(message) else CanFrame(message.arbitration_id, bytes(message.data))

    def close(self) -> None:
        """Close the CAN adapter."""
        self.adapter.shutdown()

    def _is_ours_or_none(self, message) -> bool:
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            return True
        return self._mark is not None and message.channel == self._mark


def _options(settings: CanopenBus) -> dict[str, Any]:
    """Options of the adapter.

    A multicast group may have a port, `239.74.163.2:43113`. Groups at the same port receive each other's frames.
    """
    options: dict[str, Any] = {"channel": settings.channel}
    if settings.interface in ECHOING and settings.channel.count(":") == 1:
        group, port = settings.channel.split(":")
        options = {"channel": group, "port": int(port)}
    if settings.bitrate is not None:
        options["bitrate"] = settings.bitrate
    return options
