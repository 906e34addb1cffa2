"""Options of a verification."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Seed, Within, WornOptions

LATER_MAX_MIN = 240.0


@dataclass(frozen=True)
class VerifyOptions(WornOptions):
    """Options of `exograv arm verify`."""

    calibration: Path | None = None
    """Calibration of this machine (`exograv rig calibrate`); without it the twin is calibrated first. On drives it is
    the calibration.toml in the folder of --out.
    """

    seed: Seed = 0

    before: Path | None = None
    """Figures of an earlier verification (its --json), to test if a change since then is larger than chance."""

    later_min: Annotated[
        float,
        tyro.conf.arg(name="later", metavar="MIN"),
        Within(0.0, LATER_MAX_MIN, f"0 to {LATER_MAX_MIN:g} min.", " min"),
    ] = 0.0
    """Minutes that the twin runs between identification and verification, so that friction warms up [min]."""

    def __post_init__(self):
        super().__post_init__()
        if self.later_min and self.is_on_drives:
            raise ConfigError(
                f"--later is {self.later_min:g}, but it works only with the twin. Leave it out on drives."
            )
