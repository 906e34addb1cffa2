"""Options of a session that pages steer."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.options import Donning, Loss, PersonCode, TwinOptions, Within


@dataclass(frozen=True)
class SteeredOptions(TwinOptions):
    """Options of a steered session on the twin."""

    donning: Donning = 0

    calibration: Path | None = None
    """calibration.toml of this machine; it is calibrated at the beginning where none is named, which takes a minute."""

    participants: Path | None = None
    """Folder of people's files: who is in it is only checked, 20 s instead of 60; who is learned is written there."""

    participant: Annotated[str | None, PersonCode()] = None
    """Code of whoever is in the machine at the beginning, such as P-07, never a name."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S")] = 60.0
    """Of motion, for somebody who is not known."""

    session_s: Annotated[tyro.conf.Fixed[float], Within(60.0, 7200.0)] = 3600.0
    """Longest recording [s]."""

    on_loss: Loss = "finish"
    """What becomes of an open window when nobody steers any more."""

    def written(self) -> dict[str, Any]:
        """For the recording."""
        return {name: str(value) if isinstance(value, Path) else value for name, value in asdict(self).items()}
