"""Files that do not fit are refused before a session calibrates its machine or begins its recording."""

from dataclasses import replace
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.experiment.train.options import TrainOptions
from exograv.experiment.train.train_command import run_training
from exograv.laboratory.preparation import no_progress

OPTIONS = TrainOptions(protocol="training", participant="P-07", windows=1)


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("person_file", "other.toml is of another kind.*--person-file"),
        ("calibration", r"other.toml is damaged.*`exograv rig calibrate --calib"),
    ],
)
def test_a_file_of_another_kind_is_refused_before_a_session_writes_anything(option: str, said: str, tmp_path: Path):
    other = tmp_path / "other.toml"
    other.write_text("not = TOML = at all", encoding="utf-8")
    options = replace(OPTIONS, person_file=other) if option == "person_file" else replace(OPTIONS, calibration=other)
    with pytest.raises(ConfigError, match=said):
        run_training(options, tmp_path / "out", no_progress)
    assert not (tmp_path / "out").exists()
