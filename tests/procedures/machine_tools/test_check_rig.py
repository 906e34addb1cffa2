"""Check of a machine: it is sound, or each problem is a sentence with joint, value and next step, never a traceback."""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig, rig_names, robots_folder
from exograv.procedures.machine_tools.check_rig import check_rig
from exograv.procedures.machine_tools.options import CheckOptions
from exograv.results import json_value

SOURCE = robots_folder() / "recupera_like"
LIMIT = '<limit lower="0.0" upper="2.18" effort="30" velocity="3.0"/>'
"""Limits of the elbow."""
ELBOW = '<origin xyz="0 0 -0.29" rpy="0 0 0"/>'
TASK = "upper_deg = [95.0, 50.0, 45.0, 110.0]"
DONNED = "posture_deg = [0.0, 0.0, 0.0, 90.0]"
ROTATION = '<child link="upper_arm_exo"/>\n    <origin xyz="{} 0 0"'
CUFF = """segment = "{}"
along_N_per_mm = {}
across_N_per_mm = {}
about_limb_Nm_per_deg = {}
about_others_Nm_per_deg = {}"""
WELD, POINT, NOTHING = (2.1, 4.5, 0.035, "0.20"), (2.1, 4.5, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
MASSIVE = """<link name="upper_arm_cuff"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
SLIDE = """<joint name="slide" type="prismatic"><axis xyz="0 0 1"/>
<limit lower="0" upper="0.1" effort="1" velocity="1"/>"""
FIRST, SECOND, SWAP = (f'joint = "{name}"\nplace' for name in ("shoulder_flexion", "shoulder_abduction", "swap"))


def silent(_text: str, _share: float) -> None:
    pass


def check(rig: str | Path, out: Path, **wearer: Any) -> dict[str, Any]:
    return json_value(check_rig(CheckOptions(str(rig), **wearer), out, silent))


def broken(folder: Path, *pairs: tuple[str, str]) -> list[str]:
    """Return the problems after each old text was replaced by the new one, in rig.toml or in the only URDF."""
    machine = folder / "machine"
    shutil.copytree(SOURCE, machine)
    (machine / "left.urdf").unlink()
    files = [machine / "rig.toml", machine / "right.urdf"]
    texts = [file.read_text(encoding="utf-8") for file in files]
    texts[0] = texts[0].replace('left = "left.urdf"\n', "")
    for old, new in pairs:
        assert any(old in text for text in texts), old
        texts = [text.replace(old, new) for text in texts]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text, encoding="utf-8")
    result = check(machine, folder)
    assert result["ok"] is not bool(result["problems"])
    return result["problems"]


@pytest.mark.parametrize("rig", rig_names())
@pytest.mark.usefixtures("without_picture")
def test_the_machines_that_come_with_exograv_have_no_problem_and_hold_all_freedoms(rig: str, tmp_path: Path):
    result = check(rig, tmp_path)
    assert result["problems"] == []
    assert result["ok"]
    assert result["unsupported"] == []
    assert result["rank"] == result["human_dof"] == {"recupera_like_7": 7, "recupera_like_dual": 8}.get(rig, 4)
    has_motors = load_rig(rig).settings.calibration is not None
    # Every machine except the passive one carries a wearer of 95 kg, with an arm of 4.9 % of that mass.
    assert result["largest_arm_kg"] > 4.7 if has_motors else result["largest_arm_kg"] == 0.0


@pytest.mark.parametrize("rig", ["recupera_like_dual", "recupera_like_passive"])
def test_the_check_leaves_a_picture(rig: str, tmp_path: Path):
    assert Path(check(rig, tmp_path / "new")["picture"]).read_bytes().startswith(b"\x89PNG")


WRONG = {
    "degrees for radians": (
        [(LIMIT, LIMIT.replace('upper="2.18"', 'upper="125"'))],
        r"joint 'elbow_flexion'.*125.* rad.*degrees",
    ),
    "ten degrees for radians": (
        [(LIMIT, LIMIT.replace('upper="2.18"', 'upper="10"'))],
        r"joint 'elbow_flexion' turns from 0 to 10 rad, more than a full turn. These may be degrees; URDF is in rad",
    ),
    "degrees per second": (
        [(LIMIT, LIMIT.replace('velocity="3.0"', 'velocity="172"'))],
        r"'elbow_flexion' may turn at 172 rad/s; allowed: up to 35. It may be in °/s",
    ),
    "millimetres for metres": (
        [(ELBOW, ELBOW.replace("-0.29", "-290")), ("nominal_m = 0.29", "nominal_m = 290"), ("= 0.37", "= 370")],
        r"joint 'elbow_flexion' from its parent is 290 m away; allowed: up to 1.5 m. It may be in mm",
    ),
    "grams for kilograms": (
        [('<mass value="0.6"/>', '<mass value="600"/>')],
        r"link 'forearm_exo' weighs 600 kg; allowed: 0.005 to 25.0 kg",
    ),
    "radians in rig.toml": (
        [
            (DONNED, DONNED.replace("90.0", "1.57")),
            ("lower_deg = [0.0, 0.0, -40.0, 25.0]", "lower_deg = [0.0, 0.0, -0.7, 0.4]"),
            (TASK, "upper_deg = [1.66, 0.87, 0.79, 1.92]"),
        ],
        r"the largest angle of \[donning\] and \[task_workspace\] is 1.92°. It seems to be in radians",
    ),
    "a joint without actuator": (
        [('<joint name="upper_arm_cuff_mount" type="fixed">', SLIDE), ('<link name="upper_arm_cuff"/>', MASSIVE)],
        r"joint 'slide' of right.urdf has no entry in \[\[actuators\]\].*'passive'",
    ),
    "an actuator without joint": (
        [('name="elbow_flexion"', 'name="elbow"')],
        r"\[\[actuators\]\] has a joint 'elbow_flexion', which does not move in right.urdf. Joints there: ",
    ),
    "a swapped order": (
        [(FIRST, SWAP), (SECOND, FIRST), (SWAP, SECOND)],
        r"the order shoulder_abduction, .*; those of right.urdf in the order shoulder_flexion,.*Use the URDF's order",
    ),
    "a frame that does not exist": (
        [('exo_frame = "forearm_cuff"', 'exo_frame = "cuff"')],
        r"exo_frame of cuff 'forearm' is 'cuff', no link of right.urdf. Links there: .*forearm_cuff",
    ),
    "a shoulder centre that moves": (
        [('shoulder_centre = "shoulder_centre"', 'shoulder_centre = "upper_arm_cuff"')],
        r"wearer.shoulder_centre \(right\) is 'upper_arm_cuff', which moves with a joint.*Fix that link to the base",
    ),
    "a length that is not the URDF's": (
        [("nominal_m = 0.29", "nominal_m = 0.30")],
        r"adjustment of 'elbow_flexion': nominal_m is 0.3 m; right.urdf has 0.29 m along z",
    ),
    "a stronger drive than the URDF allows": (
        [("torque_max_Nm = 30.0", "torque_max_Nm = 40.0")],
        r"torque_max_Nm of 'elbow_flexion' is 40.0 N·m; right.urdf allows 30 N·m",
    ),
    "a task beyond the limits": (
        [(TASK, TASK.replace("110", "140"))],
        r"task_workspace takes 'elbow_flexion' from 25.0 to 140.0°; its limits are 0.0 to 124.9°",
    ),
    "one point on the forearm": (
        [(CUFF.format("upper_arm", *WELD), CUFF.format("upper_arm", *NOTHING)),
         (CUFF.format("forearm", *WELD), CUFF.format("forearm", *POINT))],
        r"the cuffs \(upper_arm, forearm\) leave the arm free in \w+ \(in \d+ postures\).* Add a cuff",
    ),
    "cuffs without any stiffness": (
        [(CUFF.format(name, *WELD), CUFF.format(name, *NOTHING)) for name in ("upper_arm", "forearm")],
        r"leave the arm free in elbow \(in 17 postures\)",
    ),
    "a cuff that is too soft": (
        [(CUFF.format("upper_arm", *WELD), CUFF.format("upper_arm", *NOTHING)),
         (CUFF.format("forearm", *WELD), CUFF.format("forearm", 2.1, 4.5, 1e-4, 0.001))],
        r"hold rotation with 0.\d+ N·m/rad only; allowed: at least 0.5 N·m/rad",
    ),
    "a task far beyond the limits": (
        [(TASK, TASK.replace("110.0", "100000.0"))],
        r"task_workspace takes 'elbow_flexion' from 25.0 to 100000.0°",
    ),
    "angles of the arm beyond a half turn": (
        [(DONNED, DONNED + "\narm_posture_deg = [0.0, 0.0, 0.0, 5156.6]")],
        r"donning.arm_posture_deg holds 5156.6°; allowed: ±180°",
    ),
    "a cuff beside the limb": (
        [('<origin xyz="0 0 -0.17" rpy="0 0 0"/>', '<origin xyz="0.3 0 -0.17" rpy="0 0 0"/>')],
        r"cuff 'forearm' is 300 mm beside the axis of the forearm at donning",
    ),
    "a cuff across the limb": (
        [('<origin xyz="0 0 -0.17" rpy="0 0 0"/>', '<origin xyz="0 0 -0.17" rpy="0 1.57 0"/>')],
        r"'forearm_cuff' is 90° off the axis of the forearm at donning; allowed: 30°. A cuff's z is along",
    ),
    "an arm that is donned elsewhere": (
        [(DONNED, DONNED + "\narm_posture_deg = [90.0, 0.0, 0.0, 90.0]")],
        r"the wearer's elbow is \d+ mm beside the axis of 'elbow_flexion' at donning",
    ),
    "names of two axes that are exchanged": (
        [("shoulder_flexion", "of_x"), ("shoulder_abduction", "shoulder_flexion"), ("of_x", "shoulder_abduction")],
        r"'shoulder_abduction' turns about the arm's axis of flexion, 'shoulder_flexion' turns about .* of abduction",
    ),
    "loops that cannot close": (
        [(ROTATION.format("0"), ROTATION.format("0.15"))],
        r"the loops of machine and arm cannot close: at \[.*\]° a cuff is stretched by \d+ mm",
    ),
    "a weak shoulder": (
        [("torque_max_Nm = 60.0", "torque_max_Nm = 14.0")],
        r"hold an arm of 0.0 kg with 1 kg in the hand; the lightest adult's weighs 2.02 kg. 'shoulder_flexion' reaches",
    ),
    "a torque constant in mN·m/A": (
        [("torque_constant_Nm_per_A = 0.060", "torque_constant_Nm_per_A = 60.0")],
        r"'elbow_flexion' gives 4500 N·m/A .* would need 0.0067 A .* torque_constant_Nm_per_A is not in mN",
    ),
    "a rotor without its gear's square": (
        [("rotor_inertia_kgm2 = 0.25\n", "rotor_inertia_kgm2 = 250.0\n")],
        r"rotor_inertia_kgm2 of 'elbow_flexion' is 250 kg·m²; allowed: up to 2",
    ),
    "a cuff in N/m": (
        [(CUFF.format("forearm", *WELD), CUFF.format("forearm", 2100, 4500, 0.035, 0.20))],
        r"along_N_per_mm of cuff 'forearm' is 2100; allowed: up to 500",
    ),
    "a weight above the joint": (
        [('mount = "calibration_mount"', 'mount = "upper_arm_cuff"')],
        r"weight at 'upper_arm_cuff' loads 'elbow_flexion' with 0.00 N·m in its sweep; .* name a link beyond",
    ),
    "weights in g": ([("weights_kg = [1.5, 3.0]", "weights_kg = [1500, 3000]")], "holds 1500 kg; .* It may be in g"),
    "weights that the motors do not carry": (
        [("weights_kg = [1.5, 3.0]", "weights_kg = [6.0, 12.0]")],
        r"carries at most [\d.]+ kg at 'calibration_mount'; the heaviest known weight has 12 kg. Set calib",
    ),
    "no rig.toml that can be read": ([('name = "recupera_like"', "name = ")], "rig.toml is not valid TOML"),
    "no URDF": ([('right = "right.urdf"', 'right = "arm.urdf"')], r"rig.toml names 'arm.urdf', which is not in"),
    "a URDF that is none": ([('<robot name="recupera_like_right">', "<nothing>")], r"right.urdf is not valid XML"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
@pytest.mark.usefixtures("without_picture")
def test_what_is_wrong_is_said_with_its_place(case: str, tmp_path: Path):
    pairs, expected = WRONG[case]
    problems = broken(tmp_path, *pairs)
    assert any(re.search(expected, problem) for problem in problems), problems


@pytest.mark.usefixtures("without_picture")
def test_several_mistakes_are_said_at_once(tmp_path: Path):
    problems = broken(
        tmp_path,
        (LIMIT, LIMIT.replace('upper="2.18"', 'upper="10"').replace("3.0", "172")),
        ('name = "recupera_like"\n', 'name = "recupera_like"\ncolour = "red"\n'),
        ("efficiency = 0.75", "efficiency = 75"),
    )
    text = "\n".join(problems)
    for part in ("more than a full turn", "in °/s", "colour", "actuators.0.efficiency", "actuators.3.efficiency"):
        assert part in text


@pytest.mark.usefixtures("without_picture")
def test_a_singular_posture_in_the_task_is_a_problem(tmp_path: Path):
    text = (robots_folder() / "agree_like" / "rig.toml").read_text(encoding="utf-8")
    shutil.copytree(robots_folder() / "agree_like", tmp_path / "machine")
    lower = "lower_deg = [-50.0, 30.0,"
    assert lower in text
    (tmp_path / "machine" / "rig.toml").write_text(text.replace(lower, "lower_deg = [-50.0, 0.0,"), encoding="utf-8")
    (problem,) = check(tmp_path / "machine", tmp_path)["problems"]
    assert re.search(r"nearly singular posture \(.*shoulder_elevation 0°.*conditioning 0.00", problem)


@pytest.mark.usefixtures("without_picture")
def test_a_vertical_axis_that_no_weight_loads_is_no_problem(tmp_path: Path):
    result = check("agree_like", tmp_path)
    vertical = [name for note in result["notes"] for name in re.findall(r"'(\w+)' is vertical", note)]
    assert vertical == ["shoulder_horizontal_adduction"]


@pytest.mark.parametrize(("height", "fits"), [(1.75, True), (2.19, True), (1.21, False)])
@pytest.mark.usefixtures("without_picture")
def test_an_arm_that_the_machine_cannot_be_set_to_is_refused(height: float, fits: bool, tmp_path: Path):
    result = check("recupera_like", tmp_path, height_m=height, mass_kg=75.0 if fits else 30.0, sex="female")
    assert result["ok"] is fits
    if not fits:
        assert re.search(r"takes upper_arm lengths of 0.2 to 0.37 m; this wearer's is 0.19\d m", result["problems"][0])


@pytest.mark.usefixtures("without_picture")
def test_an_arm_longer_than_a_machine_of_fixed_length_strains_its_loops(tmp_path: Path):
    text = (SOURCE / "rig.toml").read_text(encoding="utf-8")
    shutil.copytree(SOURCE, tmp_path / "machine")
    start, end = text.index("[[adjustments]]"), text.index("# One weld-like")
    (tmp_path / "machine" / "rig.toml").write_text(text[:start] + text[end:], encoding="utf-8")
    fitting, long = (check(tmp_path / "machine", tmp_path, height_m=height) for height in (1.79, 2.2))
    assert fitting["ok"]
    assert fitting["loops"]["stretch_mm"] < 1.0
    assert long["loops"]["stretch_mm"] > 15.0
    assert any("beside the axis of 'elbow_flexion'" in problem for problem in long["problems"])


def test_a_folder_without_a_rig_file_is_told_how_to_get_one(tmp_path: Path):
    result = check(tmp_path, tmp_path)
    assert not result["ok"]
    assert "has no rig.toml. `exograv rig new URDF` writes one" in result["problems"][0]


def test_a_name_that_is_none_is_refused():
    with pytest.raises(ConfigError, match="No machine 'nobody'"):
        check("nobody", Path())


@pytest.mark.usefixtures("without_picture")
def test_half_of_the_drives_torque_carries_less_than_half_of_the_arm(tmp_path: Path):
    # Machine, weight in the hand and friction need a part of the torque first.
    whole = check("agree_like", tmp_path)
    shutil.copytree(robots_folder() / "agree_like", tmp_path / "machine")
    text = (tmp_path / "machine" / "rig.toml").read_text(encoding="utf-8")
    (tmp_path / "machine" / "rig.toml").write_text(text.replace("torque_max_Nm = 40.0", "torque_max_Nm = 30.0"))
    half = check(tmp_path / "machine", tmp_path)
    assert 0.0 < half["largest_arm_kg"] < 0.75 * whole["largest_arm_kg"]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.usefixtures("without_picture")
def test_a_file_with_a_piece_missing_never_ends_in_a_traceback(seed: int, tmp_path: Path):
    machine = tmp_path / "machine"
    shutil.copytree(SOURCE, machine)
    file = machine / ("rig.toml" if seed % 2 else "right.urdf")
    text = file.read_text(encoding="utf-8")
    start = len(text) * seed // 7
    file.write_text(text[:start] + text[start + 150 :], encoding="utf-8")
    result = check(machine, tmp_path)
    assert isinstance(result["problems"], list)
