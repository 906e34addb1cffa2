"""Options of a session that pages steer."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.options import Acts, Donning, Level, Loss, PersonCode, Seed, TwinOptions, Within, World

MOVED = Acts(lambda all_: not all_.rehearse, "on a machine, without --rehearse")


@dataclass(frozen=True)
class SteeredOptions(TwinOptions):
    """Options of a steered session on the twin."""

    level: Annotated[Level, MOVED] = 2
    world: Annotated[World, MOVED] = "home"
    seed: Annotated[Seed, MOVED] = 0
    donning: Annotated[Donning, MOVED] = 0

    calibration: Annotated[Path | None, MOVED] = None
    """File calibration.toml of this machine.

    Without it the machine is calibrated at the start, which takes a minute.
    """

    participants: Annotated[Path | None, MOVED] = None
    """Folder of participant files. A known arm is only checked, in 20 s instead of 60. New arms are written there."""

    participant: Annotated[str | None, PersonCode()] = None
    """Code of the person in the machine at the start, such as P-07, never a name."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), MOVED] = 60.0
    """Duration of the motion that identifies an unknown person."""

    session_s: Annotated[tyro.conf.Fixed[float], Within(60.0, 7200.0)] = 3600.0
    """Longest recording [s]."""

    on_loss: Annotated[Loss, MOVED] = "finish"
    """Action on an open window when the operator's page is lost."""

    def written(self) -> dict[str, Any]:
        """Options for the recording."""
        return {name: str(value) if isinstance(value, Path) else value for name, value in asdict(self).items()}
