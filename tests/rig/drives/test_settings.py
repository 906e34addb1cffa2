"""A wrong drives.toml is refused with place and value."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.rig.drives.settings import load_drives

EXAMPLES = Path(__file__).parents[3] / "examples" / "drives"
RIG = load_rig("recupera_like")


@pytest.mark.parametrize("name", ["udp", "canopen"])
def test_the_examples_are_read_and_their_joints_come_in_the_order_of_the_machine(name: str):
    drives = load_drives(EXAMPLES / f"{name}.toml", RIG)
    assert drives.joints == RIG.joints
    assert drives.without_brake == ()


def test_a_turn_of_the_joint_is_as_many_counts_as_the_file_says():
    drives = load_drives(EXAMPLES / "canopen.toml", RIG)
    counts = np.array([drive.counts_per_turn for drive in drives.each], dtype=float)
    np.testing.assert_allclose(drives.rad_per_count * counts, 2.0 * np.pi)


WRONG = {
    "no number for a node": ("node = 1\n", 'node = "one"\n', "node"),
    "a node beyond the bus": ("node = 1\n", "node = 128\n", "127"),
    "two drives at one address": ("node = 2\n", "node = 1\n", "two drives have node 1"),
    "two drives of one joint": ('"shoulder_rotation"', '"elbow_flexion"', "two drives have joint elbow_flexion"),
    "an unknown joint": ('"elbow_flexion"', '"knee"', "knee"),
    "an unknown key": ("node = 3\n", "node = 3\nspeed = 4\n", "speed"),
    "a watchdog that never trips": ("watchdog_ms = 20.0", "watchdog_ms = 500.0", "30"),
    "no bus": ("[udp]\n", "[[drives]]\n", "joint"),
    "another machine": ('"recupera_like"', '"agree_like"', "agree_like"),
    "more for ever than at most": ("current_rated_A = 3.0", "current_rated_A = 12.0", "exchanged"),
    "no TOML": ("schema_version = 1", "schema_version = ", "not valid TOML"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_used_is_refused_with_its_place(case: str, tmp_path: Path):
    right, wrong, named = WRONG[case]
    text = (EXAMPLES / "udp.toml").read_text(encoding="utf-8")
    assert right in text
    path = tmp_path / "drives.toml"
    path.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=named) as refused:
        load_drives(path, RIG)
    assert str(path) in str(refused.value)


def test_a_can_drive_without_counts_is_refused(tmp_path: Path):
    text = (EXAMPLES / "canopen.toml").read_text(encoding="utf-8")
    path = tmp_path / "drives.toml"
    path.write_text(text.replace("counts_per_turn = 1048576\n", "", 1), encoding="utf-8")
    with pytest.raises(ConfigError, match="counts_per_turn is missing for shoulder_flexion"):
        load_drives(path, RIG)


def test_a_file_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"nowhere\.toml cannot be read"):
        load_drives(tmp_path / "nowhere.toml", RIG)
