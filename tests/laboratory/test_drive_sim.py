"""Simulated drives reject invalid options with a reason, and are wired as the options state."""

import contextlib
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from exograv import motion
from exograv.errors import ConfigError, RigError
from exograv.laboratory.options import DriveSimOptions
from exograv.laboratory.simulated_drives.drive_sim import DRIVES_PRIORITY, _of_one_arm, _plant, _wiring, run_drive_sim
from exograv.model.description import load_rig
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.opening import SIMULATED
from exograv.rig.twin import Truth, Twin

EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
JOINTS = ("shoulder", "elbow")

WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a file of another bus": ({"drives": EXAMPLES / "canopen.toml"}, r"has no \[udp\] bus"),
    "a machine of another name": ({"rig": "agree_like"}, "has the drives of 'recupera_like'"),
    "a joint that is not there": ({"wrong_sign": ("knee",)}, "No joint knee"),
    "no factor": ({"wrong_scale": ("elbow_flexion",)}, "JOINT:FACTOR"),
    "a negative factor": ({"wrong_scale": ("elbow_flexion:-1",)}, "JOINT:FACTOR"),
}


def options(**changes: Any) -> DriveSimOptions:
    plain: dict[str, Any] = {"bus": "udp", "rig": "recupera_like", "side": None, "drives": EXAMPLES / "udp.toml"}
    return DriveSimOptions(**(plain | changes))


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_simulated_is_refused_before_anything_listens(case: str):
    changes, says = WRONG[case]
    with pytest.raises(ConfigError, match=says):
        run_drive_sim(options(**changes), Path("out"), lambda line: None)


def test_wrong_wires_multiply():
    wiring = _wiring(options(wrong_sign=("elbow",), wrong_scale=("elbow:0.5",), wrong_encoder=("shoulder",)), JOINTS)
    np.testing.assert_allclose((wiring["elbow"].current, wiring["elbow"].encoder), (-0.5, 1.0))
    np.testing.assert_allclose((wiring["shoulder"].current, wiring["shoulder"].encoder), (1.0, -1.0))


@pytest.mark.parametrize("bus", SIMULATED)
@pytest.mark.parametrize("rig", ["recupera_like", "agree_like"])
def test_a_file_of_drives_on_any_bus_is_written_for_any_machine(bus: str, rig: str, tmp_path: Path):
    description = load_rig(rig)
    drives = load_drives(written(tmp_path, description, bus), description)
    assert drives.settings.bus == bus
    assert drives.joints == description.joints


def test_without_a_file_drives_are_simulated_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO("quit\n"))
    said: list[str] = []
    run_drive_sim(DriveSimOptions(lock_step=True), Path("out"), said.append)
    assert str(Path("out") / "drive_sim" / "drives.toml") in said[0]
    assert (tmp_path / "out" / "drive_sim" / "drives.toml").is_file()


def test_simulated_drives_that_keep_time_give_their_rights_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    asked: list[tuple[int, ...]] = []

    @contextlib.contextmanager
    def noting(cpu: int, priority: int) -> Iterator[None]:
        asked.append((cpu, priority))
        yield
        asked.append(())

    monkeypatch.setattr("exograv.laboratory.simulated_drives.drive_sim.realtime", noting)
    for lock_step in (True, False):
        monkeypatch.setattr("sys.stdin", io.StringIO("quit\n"))
        run_drive_sim(DriveSimOptions(lock_step=lock_step), tmp_path, lambda _: None)
    assert asked == [(min(os.sched_getaffinity(0)), DRIVES_PRIORITY), ()]


@pytest.mark.parametrize("rig", ["recupera_like", "recupera_like_7"])
def test_a_wearer_who_holds_the_arm_does_not_shake_it(rig: str, tmp_path: Path):
    description = load_rig(rig)
    drives = load_drives(written(tmp_path, description), description)
    plant = _plant(DriveSimOptions(rig=rig, worn=True), description, drives, {})
    begin = plant.measured.q
    for _ in range(200):
        plant.step()
        assert np.abs(plant.measured.q - begin).max() < np.deg2rad(3.0)


def test_a_hand_at_one_of_two_arms_leaves_the_other_one_alone():
    both = load_rig("recupera_like_dual")
    start = both.donning_posture
    twin = Mock(spec=Twin, tau_hand=np.zeros(8), truth=Mock(spec=Truth, q=start.copy(), v=np.zeros(8)))
    hand = _of_one_arm(twin, motion.go_to(start, start + 0.5, 1.0, 0.01), both, "left")
    for _ in range(20):
        hand.act()
    assert twin.tau_hand[4:].all()
    assert not twin.tau_hand[:4].any()
    with pytest.raises(RigError, match="moves one of two arms"):
        _of_one_arm(twin, motion.hold(start, 1.0, 0.01), load_rig("recupera_like"), "right")
