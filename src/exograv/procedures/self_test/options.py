"""Options of a self-test."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import CalibratedOptions, DrivesFile


@dataclass(frozen=True)
class SelfTestOptions(CalibratedOptions):
    """Options of `exograv rig self-test`."""

    calibration: Path | None = None
    """Calibration of this machine (`exograv rig calibrate`); calibration.toml in the folder of --out if absent."""

    worn: bool = False
    """Also weigh the arm in the machine, and compare with the form, after the other steps."""

    body_mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG")] = None
    """Body mass as the operator typed it [kg]; the wearer's own if none is given. Needs --worn."""

    drives: DrivesFile = None
    """drives.toml of a real machine, empty and hanging (docs/howto/rig_test.md)."""

    def __post_init__(self):
        super().__post_init__()
        if self.body_mass_kg is not None and not self.worn:
            raise ConfigError(f"--body-mass is {self.body_mass_kg:g} kg, but no person is weighed. Give --worn too.")
        if self.worn and self.is_on_drives:
            raise ConfigError("--worn works only with the twin. Leave it out with --drives or --simulate.")
