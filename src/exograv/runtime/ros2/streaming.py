"""Streams of a run to and from other devices and programs."""

from dataclasses import dataclass

from exograv.runtime.lsl.blocks import RecordedDevices
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob

from .bridging import Bridging


@dataclass(frozen=True)
class Streaming:
    """Streams of a run; without settings there are none."""

    outlets: OutletsJob | None = None
    """Streams published over Lab Streaming Layer."""

    listening: Listening | None = None
    """Listener for other devices."""

    ros2: Bridging | None = None
    """Bridge to ROS 2."""

    @property
    def devices(self) -> RecordedDevices | None:
        """Devices for the recorder."""
        return None if self.listening is None else self.listening.devices


NO_STREAMING = Streaming()
