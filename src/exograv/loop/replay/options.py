"""Options of a replay."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from exograv.options import Options, Within


@dataclass(frozen=True)
class InsteadOptions(Options):
    """Options of `exograv data replay` that take the place of something recorded."""

    rig: str | None = None
    """Machine for a what-if replay: its present files replace the recorded ones."""

    person: Path | None = None
    """Participant file for a what-if replay: its arm replaces the identified arm from the first tick on."""

    calibration: Path | None = None
    """Calibration for a what-if replay: its machine and friction are used; the arm stays as recorded."""

    gravity_level: Annotated[float | None, Within(0.0, 1.0, "0 (weightless) to 1 (Earth).")] = None
    """Felt share of the arm's weight for a what-if replay, in every tick in which an arm is carried."""
