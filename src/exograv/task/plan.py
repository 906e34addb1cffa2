"""What a run is made from, and does not change while it goes on."""

from dataclasses import dataclass
from functools import cached_property

from exograv.errors import ConfigError

from .protocol import LoadedProtocol
from .protocol_schema import ExoMode, Protocol
from .schedule import Timeline, timeline
from .screen import ScreenCalibration


@dataclass(frozen=True)
class TaskPlan:
    """A protocol on this machine and this screen."""

    loaded: LoadedProtocol
    exo: ExoMode
    """What the machine really does."""

    screen: ScreenCalibration | None = None

    def __post_init__(self) -> None:
        if self.exo == "active" and self.protocol.exo != "active":
            raise ConfigError(
                f"Protocol '{self.protocol.name}' has a passive machine; it cannot be run with an active one. Take "
                "another protocol, or exo 'passive'."
            )

    @property
    def protocol(self) -> Protocol:
        """Its settings."""
        return self.loaded.settings

    @cached_property
    def timeline(self) -> Timeline:
        """The protocol laid out in time."""
        return timeline(self.protocol)

    @property
    def is_clocked(self) -> bool:
        """Whether the schedule opens the windows."""
        return self.protocol.opening == "clock"
