"""What a steered session is begun with."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError
from exograv.model.description import Side
from exograv.runtime.control_loop.steering import Loss
from exograv.storage.participant_file import refuse_name


@dataclass(frozen=True)
class SteeredOptions:
    """What a steered session on the twin is begun with."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    donning: int = 0
    """Number of the day on which the virtual person is in the machine."""
    calibration: Path | None = None
    """Of the machine; it is calibrated at the beginning where absent."""
    participants: Path | None = None
    """Folder of people's files: read, and written when somebody has been learned."""
    participant: str | None = None
    """Code of whoever is in it at the beginning, who is identified where the folder has no such file yet."""
    identify_s: float = 60.0
    """Of motion, if so [s]."""
    session_s: float = 3600.0
    """Longest recording [s]."""
    on_loss: Loss = "finish"
    """What becomes of a window that runs when nobody steers any more."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.participant is not None:
            refuse_name(self.participant, "--participant")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 60.0 <= self.session_s <= 7200.0:
            raise ConfigError(f"--session is {self.session_s:g} s; allowed: 60 to 7200.")

    def written(self) -> dict[str, Any]:
        """For the recording."""
        return {name: str(value) if isinstance(value, Path) else value for name, value in asdict(self).items()}
