"""Options of a replay."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from exograv.options import Options, Within


@dataclass(frozen=True)
class InsteadOptions(Options):
    """Options of `exograv replay` that take the place of something recorded."""

    rig: str | None = None
    """What if: this machine's present files in place of the recorded ones."""

    person: Path | None = None
    """What if: the arm in this participant's file from the first tick on, in place of what was identified."""

    calibration: Path | None = None
    """What if: the machine as in this calibration, its friction for the identified one; the arm as recorded."""

    gravity_level: Annotated[float | None, Within(0.0, 1.0, "0 (weightless) to 1 (Earth).")] = None
    """What if: this felt share of the arm's weight in every tick in which an arm is carried."""
