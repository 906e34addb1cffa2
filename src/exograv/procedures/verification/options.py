"""Options of a verification."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Within, WornOptions

LATER_MAX_MIN = 240.0


@dataclass(frozen=True)
class VerifyOptions(WornOptions):
    """Options of `exograv verify`."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the twin is calibrated first.
    On drives the one in the folder of --out."""

    before: Path | None = None
    """Figures of a former verification (its --json): says what changed since, and whether by more than chance."""

    later_min: Annotated[
        float,
        tyro.conf.arg(name="later", metavar="MIN"),
        Within(0.0, LATER_MAX_MIN, f"0 to {LATER_MAX_MIN:g} min.", " min"),
    ] = 0.0
    """On the twin: so many minutes the machine runs between identification and verification; friction warms [min]."""

    def __post_init__(self):
        super().__post_init__()
        if self.later_min and self.is_on_drives:
            raise ConfigError(f"--later is {self.later_min:g}; on drives time passes by itself. Leave it out.")
