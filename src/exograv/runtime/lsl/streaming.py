"""What of a run goes over Lab Streaming Layer."""

from dataclasses import dataclass

from .blocks import Devices
from .listening import Listening
from .outlets import OutletsJob


@dataclass(frozen=True)
class Streaming:
    """Out and in; nothing of both unless it is asked for."""

    outlets: OutletsJob | None = None
    """What is published."""

    listening: Listening | None = None
    """To other devices."""

    @property
    def devices(self) -> Devices | None:
        """For the recorder."""
        return None if self.listening is None else self.listening.devices


NO_STREAMING = Streaming()
