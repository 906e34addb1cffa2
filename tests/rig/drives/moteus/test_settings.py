"""A moteus with other settings than `drives.toml` or a torque command needs is refused."""

import builtins
import math
import sys
from typing import Any

import pytest

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.moteus import MoteusRig
from exograv.rig.drives.moteus.diagnostic import Diagnostic
from exograv.rig.drives.moteus.fdcanusb import Fdcanusb
from exograv.rig.drives.moteus.nameplate import MUSTS, read_plate
from exograv.rig.drives.moteus.simulated.bus import MoteusDevices
from exograv.rig.drives.opening import open_drives
from exograv.rig.drives.settings import Drives

ELBOW, SOURCE = 3, 126
WRONG = {
    "servo.timeout_mode": 12.0,
    "servo.default_timeout_s": 0.1,
    "servo.max_current_A": 20.0,
    "motor.rotation_current_cutoff_A": 5.0,
    "motor.resistance_ohm": 0.001,
    "motor.Kv": 0.0,
    "motor_position.rotor_to_output_ratio": -0.02,
    "servo.pid_position.kp": 4.0,
    "servo.pid_position.ki": 1.0,
    "servo.pid_position.kd": 0.0,
    "servopos.position_min": -0.01,
    "servopos.position_max": 0.01,
    "servo.bemf_feedforward": 1.0,
    "servo.voltage_mode_control": 1.0,
    "servo.fixed_voltage_mode": 1.0,
    "servo.fault_position_error": 0.5,
}
"""Settings of other uses of a moteus, or the maker's own; older firmware lacks the last one."""


def plate_of(drives: Drives, joint: int) -> Any:
    assert drives.settings.moteus is not None
    link = Fdcanusb(drives.settings.moteus.path)
    drive = drives.each[joint]
    try:
        return read_plate(Diagnostic(link, drive.joint, drive.node, SOURCE), drive, drives)
    finally:
        link.close()


def test_right_settings_give_the_torque_constant_and_the_kd_of_the_drive(devices: MoteusDevices, drives: Drives):
    for joint, node in enumerate(devices.nodes):
        plate, config = plate_of(drives, joint), node.config
        flux = config["motor.Kv"] * config["motor_position.rotor_to_output_ratio"]
        assert plate.torque_per_ampere == pytest.approx(8.26993 / flux, rel=1e-5)
        assert plate.kd == pytest.approx(config["servo.pid_position.kd"] / (2.0 * math.pi))


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_setting_is_refused_by_joint_and_what_it_has_to_be(name: str, devices: MoteusDevices, drives: Drives):
    devices.nodes[ELBOW].config[name] = WRONG[name]
    with pytest.raises(ConfigError, match=r"joint elbow_flexion .*no motor was switched on"):
        plate_of(drives, ELBOW)


def test_every_setting_that_is_held_is_tried_above():
    assert {must.name for must in MUSTS} - set(WRONG) == {
        "servo.fault_velocity_error"
    }  # settings that the simulated drive lacks


def test_a_setting_that_older_firmware_has_not_may_be_missing(devices: MoteusDevices, drives: Drives):
    del devices.nodes[ELBOW].config["servo.fault_position_error"]
    plate_of(drives, ELBOW)
    del devices.nodes[ELBOW].config["servo.timeout_mode"]
    with pytest.raises(RigError, match=r"elbow_flexion .*has no setting servo.timeout_mode"):
        plate_of(drives, ELBOW)


@pytest.mark.parametrize("home", [0, 1])
def test_a_drive_that_does_not_know_where_its_output_is_is_refused(home: int, devices: MoteusDevices, drives: Drives):
    devices.nodes[ELBOW].home = home
    with pytest.raises(RigError, match=r"elbow_flexion .* does not know where its output is"):
        plate_of(drives, ELBOW)


def test_a_drive_that_is_not_there_is_named(devices: MoteusDevices, drives: Drives):
    devices.unplug(ELBOW)
    with pytest.raises(RigError, match=r"elbow_flexion \(id 4\) does not answer"):
        plate_of(drives, ELBOW)


def test_a_drive_that_is_on_though_nobody_commands_it_is_refused(devices: MoteusDevices, drives: Drives):
    devices.nodes[0].mode = 9
    with pytest.raises(RigError, match=r"shoulder_flexion .* on already, in mode 9"), MoteusRig(drives):
        pass


def test_a_file_with_counts_or_a_number_for_all_is_refused(drives: Drives):
    raw = drives.settings.model_dump()
    raw["drives"][0]["counts_per_turn"] = 4096.0
    with pytest.raises(ValueError, match="rotor_to_output_ratio"):
        type(drives.settings).model_validate(raw)
    everyone = drives.each[0].model_copy(update={"node": 127})
    with pytest.raises(ConfigError, match="127"):
        MoteusRig(Drives(drives.settings, (everyone, *drives.each[1:]), ""))


def test_without_the_library_the_extra_is_named(drives: Drives, monkeypatch: pytest.MonkeyPatch):
    for name in [name for name in sys.modules if name.startswith(("moteus", "exograv.rig.drives.moteus"))]:
        monkeypatch.delitem(sys.modules, name)
    whole = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name == "moteus":
            raise ModuleNotFoundError("No module named 'moteus'", name="moteus")
        return whole(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ConfigError, match=r"pip install 'exograv\[moteus\]'"):
        open_drives(drives)
