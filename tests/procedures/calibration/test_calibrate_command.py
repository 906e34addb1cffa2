"""A friction check without a calibration is refused before the machine is opened."""

from pathlib import Path
from typing import NoReturn

import pytest

from exograv.errors import ConfigError
from exograv.procedures.calibration.calibrate_command import calibrate_and_keep
from exograv.procedures.calibration.options import CalibrateOptions


def test_a_recheck_without_a_calibration_opens_no_machine_and_names_the_command_that_makes_one(tmp_path: Path):
    def connect(_description: object) -> NoReturn:
        raise AssertionError("The machine was opened.")

    options = CalibrateOptions(drives=Path("drives.toml"), recheck=True)
    with pytest.raises(ConfigError, match=r"`exograv rig calibrate --drives drives\.toml --out \S+`"):
        calibrate_and_keep(options, tmp_path / "calibration.toml", connect)
