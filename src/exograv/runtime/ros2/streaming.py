"""What of a run goes to other devices and programs while it lasts, and comes from them."""

from dataclasses import dataclass

from exograv.runtime.lsl.blocks import RecordedDevices
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob

from .bridging import Bridging


@dataclass(frozen=True)
class Streaming:
    """Nothing unless it is asked for."""

    outlets: OutletsJob | None = None
    """What is published over Lab Streaming Layer."""

    listening: Listening | None = None
    """To other devices."""

    ros2: Bridging | None = None
    """To ROS 2."""

    @property
    def devices(self) -> RecordedDevices | None:
        """For the recorder."""
        return None if self.listening is None else self.listening.devices


NO_STREAMING = Streaming()
