"""A motion file is flown only by the machine for which it can be meant."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.identification.excitation.basis import excitation_text
from exograv.model.description import load_rig
from exograv.model.rig_settings import Excitation
from exograv.procedures.calibration.empty_motion import empty_motion, read_empty_motion
from exograv.procedures.calibration.options import CalibrateOptions

RIG = load_rig("recupera_like")
BLOCK = Excitation(
    period_s=10.0,
    source="designed",
    centre_deg=[30.0, 20.0, 0.0, 50.0],
    sine_deg=[[10.0, 5.0, 5.0, 10.0]],
    cosine_deg=[[0.0, 0.0, 5.0, 0.0]],
)


def written(path: Path, block: Excitation) -> Path:
    path.write_text(excitation_text(block), encoding="utf-8")
    return path


def test_a_motion_survives_its_file(tmp_path: Path):
    assert read_empty_motion(written(tmp_path / "m.toml", BLOCK), RIG) == BLOCK


def test_the_motion_begins_and_ends_at_rest():
    path = empty_motion(BLOCK, np.zeros(4), 0.001)
    assert np.abs(path.v[[0, -1]]).max() < 1e-3
    assert np.abs(np.diff(path.q, axis=0)).max() < 2e-3


def test_a_motion_beyond_the_range_of_a_joint_is_refused(tmp_path: Path):
    far = BLOCK.model_copy(update={"sine_deg": [[300.0, 5.0, 5.0, 10.0]]})
    with pytest.raises(ConfigError, match="moves joint 'shoulder_flexion' from"):
        read_empty_motion(written(tmp_path / "m.toml", far), RIG)


def test_a_motion_of_another_machine_is_refused(tmp_path: Path):
    short = BLOCK.model_copy(update={"centre_deg": [30.0]})
    with pytest.raises(ConfigError, match="another number of joints"):
        read_empty_motion(written(tmp_path / "m.toml", short), RIG)


def test_a_file_without_a_motion_is_refused(tmp_path: Path):
    (tmp_path / "m.toml").write_text("a = 1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="holds no motion"):
        read_empty_motion(tmp_path / "m.toml", RIG)


def test_a_recheck_flies_no_motion(tmp_path: Path):
    with pytest.raises(ConfigError, match="belong to a whole calibration"):
        CalibrateOptions("recupera_like", recheck=True, motion=tmp_path / "m.toml")
