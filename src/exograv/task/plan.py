"""Plan of a run: the inputs that stay constant during the run."""

from dataclasses import dataclass
from functools import cached_property

from exograv.errors import ConfigError

from .protocol import LoadedProtocol
from .protocol_schema import ExoMode, Protocol
from .schedule import Timeline, timeline
from .screen import ScreenCalibration


@dataclass(frozen=True)
class TaskPlan:
    """Protocol on this machine and this screen."""

    loaded: LoadedProtocol
    exo: ExoMode
    """Real mode of the machine."""

    screen: ScreenCalibration | None = None

    def __post_init__(self) -> None:
        if self.exo == "active" and self.protocol.exo != "active":
            raise ConfigError(
                f"Protocol '{self.protocol.name}' is for a passive machine and cannot be run with an active one. Use "
                "another protocol, or exo 'passive'."
            )

    @property
    def protocol(self) -> Protocol:
        """Settings of the protocol."""
        return self.loaded.settings

    @cached_property
    def timeline(self) -> Timeline:
        """Schedule of the protocol."""
        return timeline(self.protocol)

    @property
    def is_clocked(self) -> bool:
        """True if the schedule opens the windows."""
        return self.protocol.opening == "clock"
