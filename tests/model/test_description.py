"""A machine's folder is read completely, and a mistake in it is refused with file, place and value."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig, rig_names, robots_folder

SOURCE = robots_folder() / "recupera_like"
TOML = (SOURCE / "rig.toml").read_text(encoding="utf-8")


def refusal(folder: Path, *pairs: tuple[str, str]) -> str:
    text = TOML
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    machine = folder / "machine"
    shutil.copytree(SOURCE, machine)
    (machine / "rig.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(machine))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('title = "', 'colour = "red"\ntitle = "', "colour: Extra inputs are not permitted (value 'red')"),
        ("gear_ratio = 100.0", "gear_ratio = 100.0\nratio = 2", "actuators.0.ratio: Extra inputs are not permitted"),
        ("torque_max_Nm = 60.0", "torque_max_Nm = 0.0", "actuators.0.torque_max_Nm: Input should be greater than 0"),
        ("torque_max_Nm = 60.0", "torque_max_Nm = inf", "actuators.0.torque_max_Nm: Input should be a finite number"),
        ("torque_max_Nm = 60.0", "", "shoulder_flexion has a motor; it needs torque_max_Nm"),
        ("efficiency = 0.75", "efficiency = 75", "actuators.0.efficiency: Input should be less than or equal to 1"),
        ("along_N_per_mm = 2.1", "along_N_per_mm = -2.1", "cuffs.0.along_N_per_mm"),
        ("along_N_per_mm = 2.1", 'along_N_per_mm = "soft"', "(value 'soft')"),
        ("along_N_per_mm = 2.1", "along_N_per_mm = nan", "cuffs.0.along_N_per_mm: Input should be a finite number"),
        ('segment = "upper_arm"', 'segment = "hand"', "adjustments.0.segment"),
        ('segment = "forearm"', 'segment = "hand"', "wearer.arm must then be one that moves the wrist"),
        ('drive = "harmonic"', 'drive = "hydraulic"', "(value 'hydraulic')"),
        ("weights_kg = [1.5, 3.0]", "weights_kg = [1.5]", "calibration.weights_kg"),
        ("posture_deg = [0.0, 0.0, 0.0, 90.0]", "posture_deg = [0.0, 90.0]", "donning.posture_deg has 2 entries"),
        ("lower_deg = [0.0, 0.0,", "lower_deg = [0.0,", "task_workspace.lower_deg has 3 entries"),
        ("lower_deg = [0.0,", "lower_deg = [99.0,", "lower_deg 99.0 must be below upper_deg 95.0"),
        ("centre_deg = [", "centre_deg = [0.0, ", "excitation.centre_deg has 5 entries"),
        ("sine_deg = [[", "sine_deg = [[0.0, ", "excitation.sine_deg[0] has 5 entries"),
        ("\ncosine_deg = [", "\ncosine_deg = [[0.0, 0.0, 0.0, 0.0], ", "as many rows as each other"),
        ("posture_deg = [0.0, 5.0, 0.0, 45.0]", "posture_deg = []", "calibration.sweeps.0.posture_deg"),
        ("nominal_m = 0.29", "nominal_m = 29.0", "29.0 m must lie between 0.2 and 0.37 m"),
        ('joint = "elbow_flexion"', 'joint = "elbow"', "no actuator moves 'elbow'"),
        ('name = "forearm"', 'name = "upper_arm"', "cuffs upper_arm, upper_arm: two share a name"),
        ('right = "right.urdf"', 'right = "straight.urdf"', "names 'straight.urdf', which is not in"),
        ("[urdf]", "[urdf", "is not valid TOML"),
    ],
)
def test_a_mistake_in_the_rig_file_is_refused_with_its_place(tmp_path: Path, old: str, new: str, expected: str):
    message = refusal(tmp_path, (old, new))
    assert expected in message
    assert str(tmp_path / "machine") in message


def test_a_rig_file_that_is_not_utf_8_is_refused(tmp_path: Path):
    machine = tmp_path / "machine"
    shutil.copytree(SOURCE, machine)
    (machine / "rig.toml").write_bytes(TOML.replace("Recupera-like", "Récupéra", 1).encode("latin-1"))
    with pytest.raises(ConfigError, match="not valid TOML"):
        load_rig(str(machine))


@pytest.mark.parametrize("name", ["recupera", "recupera-like", "recuperalike", "Recupera_like"])
def test_a_misspelt_machine_is_answered_with_the_nearest_name(name: str):
    with pytest.raises(ConfigError, match=f"No machine '{name}'. Did you mean 'recupera_like'"):
        load_rig(name)


@pytest.mark.parametrize("name", ["", "..", "xyz", "/nowhere"])
def test_an_unknown_machine_is_answered_with_all_names(name: str):
    with pytest.raises(ConfigError, match=f"Known: {', '.join(rig_names())}"):
        load_rig(name)


def test_the_hash_changes_with_either_file(tmp_path: Path):
    hashes = set()
    for changed in (None, "rig.toml", "right.urdf"):
        machine = tmp_path / f"without_{changed}"
        shutil.copytree(SOURCE, machine)
        if changed is not None:
            with (machine / changed).open("a", encoding="utf-8") as file:
                file.write("\n")
        hashes.add(load_rig(str(machine)).sha256)
    assert len(hashes) == 3


def test_a_cuffs_stiffness_is_in_newtons_per_metre_and_per_radian():
    stiffness = load_rig("recupera_like").settings.cuffs[0].stiffness
    about_others, about_limb = 0.20 * 180 / np.pi, 0.035 * 180 / np.pi
    np.testing.assert_allclose(stiffness, [4500.0, 4500.0, 2100.0, about_others, about_others, about_limb])


def test_a_machine_with_motors_must_say_how_they_are_calibrated_and_how_they_move(tmp_path: Path):
    start, end = TOML.index("[calibration]"), TOML.index("# Harmonics of one period")
    message = refusal(tmp_path, (TOML[start:end], ""))
    assert "motors at shoulder_flexion, shoulder_abduction, shoulder_rotation, elbow_flexion: calibration" in message


def test_a_machine_without_motors_needs_neither_and_says_why_it_cannot():
    passive = load_rig("recupera_like_passive")
    assert passive.mounts == ()
    assert passive.motorless == passive.joints
    for what in ("calibration", "excitation"):
        with pytest.raises(ConfigError, match=r"recupera_like_passive has no motors: it cannot .* `exograv rigs`"):
            getattr(passive, what)


def test_one_motor_among_passive_joints_needs_a_calibration(tmp_path: Path):
    passive = (robots_folder() / "recupera_like_passive" / "rig.toml").read_text(encoding="utf-8")
    motor = TOML[TOML.index('drive = "harmonic"') : TOML.index('[[actuators]]\njoint = "shoulder_abduction"')]
    text = passive.replace('drive = "passive"', motor, 1)
    shutil.copytree(robots_folder() / "recupera_like_passive", tmp_path / "machine")
    (tmp_path / "machine" / "rig.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="motors at shoulder_flexion: calibration and excitation must say"):
        load_rig(str(tmp_path / "machine"))
