"""A machine for the console is prepared from a calibration file, or calibrated on the page."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.prepared_machine import PreparedMachine


def test_a_missing_calibration_is_refused_before_any_page_is_served(tmp_path: Path):
    options = SteeredOptions(seed=3, calibration=tmp_path / "none.toml")
    with pytest.raises(ConfigError, match=r"none\.toml cannot be read.*`exograv rig calibrate --seed 3 --calibration"):
        PreparedMachine(options, None)
