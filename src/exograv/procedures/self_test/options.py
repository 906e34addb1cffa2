"""Options of a self-test."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import CalibratedOptions, DrivesFile


@dataclass(frozen=True)
class SelfTestOptions(CalibratedOptions):
    """Options of `exograv self-test`."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); calibration.toml in the folder of --out if none is
    named."""

    worn: bool = False
    """Then also weigh the arm in the machine against the form."""

    body_mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG")] = None
    """With --worn: body mass as the operator typed it [kg]; the wearer's own if none is given."""

    drives: DrivesFile = None
    """drives.toml of a real machine, empty and hanging (docs/rig_test.md)."""

    simulate: bool = False
    """Practise on simulated drives in another process."""

    def __post_init__(self):
        super().__post_init__()
        if self.body_mass_kg is not None and not self.worn:
            raise ConfigError(f"--body-mass is {self.body_mass_kg:g} kg, and nobody is weighed: give --worn too.")
        if self.worn and self.is_on_drives:
            raise ConfigError("--worn is for the twin so far: leave it out with --drives or --simulate.")
