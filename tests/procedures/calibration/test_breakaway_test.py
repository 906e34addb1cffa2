"""Breakaway test: a machine that differs from its files is refused with joint and value, without a runaway."""

from pathlib import Path

import numpy as np
import pytest
from tests.foreign_machines import ONE_AXIS, answered, task, written

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.at_rest import carrying_torque, hanging_posture, weight_stiffness
from exograv.errors import ConfigError, IdentificationError
from exograv.identification.calibration.empty_checks import OFFSET_MAX
from exograv.identification.calibration.empty_prior import COULOMB, usual_friction
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.tree import Tree
from exograv.procedures.calibration.breakaway_checks import (
    MOVED,
    refuse_not_hanging,
    refuse_restless,
    refuse_spring,
)
from exograv.procedures.calibration.breakaway_test import BreakawayTester, held_torque, not_held, starting_posture
from exograv.procedures.calibration.empty_run import EmptyRun
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import NewRigOptions
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.safety.envelope import Envelope

SCRIPT = "corrupted.py"
SEED = 1012
V_MAX = 5.0  # rad/s: the envelope's trip speed, which a machine must not truly reach
PUSHED = "Joint 'shoulder_flexion' moved by -1."
ASKED = "Joint 'shoulder_flexion' was commanded"
OTHER_WAY = "Its encoder or its motor counts the other way round"
MILLI = "(mA for A)"
QUICK: dict[str, tuple[str, ...]] = {
    "encoder reversed": (
        "'shoulder_flexion', which reads -27.",
        "hanging by the URDF: 27°",
        "this encoder is reversed",
    ),
    "encoder reversed, light": ("'shoulder_flexion', which reads -27.", "this encoder is reversed"),
    "encoder reversed where nothing weighs": ("Joint 'shoulder_rotation' moved by -1.", OTHER_WAY, "flip the sign"),
    "motor reversed": (PUSHED, OTHER_WAY),
    "motor reversed, light": (PUSHED, OTHER_WAY),
    "motor reversed, its current not": (ASKED, "the sign of the current in the driver"),
    "degrees": ("'shoulder_flexion' reads 27.", "turns from -0.70 to 2.30 rad", "It may count in degrees"),
    "degrees at zero": ("'shoulder_abduction' was pushed by 1.15° and came back", "counts in degrees"),
    "current in mA": (ASKED, MILLI),
    "drive takes mA": (ASKED, MILLI),
    "drive gives kA": ("'shoulder_flexion'", MILLI),
    "drive gives kA, light": ("'shoulder_flexion'", MILLI),
    "drive gives kA and says A": ("'shoulder_flexion'", MILLI),
    "drive gives kA and says A, light": ("'shoulder_flexion'", "mA for A"),
    "constant in mN·m": ("'shoulder_rotation' would need 0.00", "0.2 to 500 A are plausible", "not mN·m/A"),
    "constant in kN·m": ("'shoulder_rotation' would need 6.", "0.2 to 500 A are plausible"),
    "other order": ("They must be the same, in the same order", "rig.toml"),
    "encoders swapped": ("'shoulder_flexion', which reads -6.", "or is swapped with another"),
    "motors swapped": ("Pushing joint 'shoulder_flexion'", "moved 'shoulder_abduction'", "correct their order"),
    "all swapped": ("'shoulder_flexion', which reads 4.", "is swapped with another"),
    "all reversed": ("'shoulder_flexion', which reads -27.", "this encoder is reversed"),
    "blocked": ("'shoulder_flexion' did not move under 15.0 N·m", "Free it"),
    "blocked, light": ("'shoulder_flexion' did not move under 2.4 N·m", "Free it"),
    "disconnected": (ASKED, "its motor is disconnected"),
    "disconnected, noise measured": (ASKED, "its motor is disconnected"),
}
SLOW: dict[str, tuple[str, ...]] = {
    "weights in pounds": ("The weight of 1.5 kg acts like 0.", "pounds"),
    "all reversed where nothing weighs": ("both reversed",),
    "encoder shifted": ("The encoder of joint 'elbow_flexion' reads +", "3° are allowed"),
    "gain for peak current": ("The gain of joint 'shoulder_abduction' is", "35% are allowed"),
}


def near_its_limit(folder: Path, upper_deg: float = 0.0) -> tuple[RigDescription, Tree]:
    """Return a heavy machine with light friction whose first joint hangs at its limit."""
    text = ONE_AXIS.replace('<mass value="0.9"/>', '<mass value="9.0"/>')
    found = new_rig(NewRigOptions(written(folder, text), folder / "mine", side="right"))
    drives = {"drives.drive": ['"quasi_direct"'], "actuators.range_deg": [f"[-120.0, {upper_deg}]", "[0.0, 130.0]"]}
    answered(found.folder, task("[-90.0, 25.0]", "[0.0, 110.0]") | drives)
    rig = load_rig(str(found.folder))
    return rig, read_exoskeleton(rig)


@pytest.mark.parametrize("case", QUICK)
def test_what_is_wrong_is_found_by_pushes_and_named(quick: dict, case: str):
    found = quick[case]
    assert found["kind"] in ("IdentificationError", "ConfigError")
    for part in QUICK[case]:
        assert part in found["text"]
    assert found["v_max"] < V_MAX
    assert found["tau_max"] <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOW)
def test_what_pushes_do_not_show_is_found_before_the_fit_is_believed(slow: dict, case: str):
    found = slow[case]
    assert found["kind"] == "IdentificationError"
    for part in SLOW[case]:
        assert part in found["text"]
    assert found["v_max"] < V_MAX
    assert found["tau_max"] <= 1.0


@pytest.mark.slow
def test_a_machine_with_nothing_wrong_is_calibrated(slow: dict):
    assert slow["nothing wrong"]["kind"] == ""
    assert slow["nothing wrong"]["v_max"] < 2.0


def test_the_check_of_the_first_reading_moves_nothing(quick: dict):
    assert quick["degrees"]["t"] == quick["constant in mN·m"]["t"] == quick["other order"]["t"] == 0.0
    assert quick["encoder reversed"]["t"] == quick["encoders swapped"]["t"] == 0.0


def test_a_machine_that_moves_by_itself_is_refused():
    with pytest.raises(IdentificationError, match=r"'shoulder_rotation' moves at -17\.2°/s while nothing pushes it"):
        refuse_restless(load_rig("recupera_like"), np.array([0.0, 0.1, -0.3, 0.0]))


def test_what_it_takes_to_push_a_joint_both_ways_is_its_breakaway_friction():
    rig = load_rig("recupera_like")
    tree = read_exoskeleton(rig)
    truth = draw_machine(rig, Disturbances.at_level(2), SEED)
    twin = Twin(rig, truth, None, SEED, starting_posture(tree))
    gains = ActuatorGain(rig.nominal_gain, 0.08 * rig.nominal_gain)
    pilot = Pilot(twin, gains, Envelope(limits(rig), twin.period_s))
    run = EmptyRun(rig, tree, pilot)
    nudger = BreakawayTester(run)
    nudger._wait("")
    found = np.mean([nudger._starts(3, sign, 1, "") for sign in (1.0, -1.0)])
    expected = truth.friction.coulomb * truth.friction.breakaway * rig.nominal_gain / truth.drives.gain
    assert found == pytest.approx(expected[3], rel=0.1)
    kept = run.sweeps()
    np.testing.assert_array_equal(np.sign(kept.v[kept.start, 3]), [1.0, -1.0])


def refused_at(rig: RigDescription, tree: Tree, q: np.ndarray) -> str:
    """Return the refusal of this reading [rad]; empty if it is accepted."""
    try:
        weight = not_held(tree, q, held_torque(rig, tree))
        refuse_not_hanging(rig, starting_posture(tree), q, weight, weight_stiffness(tree, q))
    except ConfigError as error:
        return str(error)
    return ""


def test_a_joint_that_hangs_inside_the_margin_of_its_limit_is_accepted_where_it_hangs(tmp_path: Path):
    rig, tree = near_its_limit(tmp_path)
    free, usual = hanging_posture(tree, 0.0), usual_friction(rig, COULOMB)[0][0]
    # By the URDF a motor has to lift this joint to the start, by more than friction and an encoder explain.
    assert np.abs(held_torque(rig, tree)[0]) > usual + OFFSET_MAX * np.abs(weight_stiffness(tree, free)[0]).sum()
    assert not refused_at(rig, tree, free)
    assert not refused_at(rig, tree, starting_posture(tree))
    for raised in (-0.3, 0.3):
        assert "Let the machine hang" in refused_at(rig, tree, free + np.array([raised, 0.0]))


def test_a_heavy_machine_with_light_friction_may_have_an_encoder_that_is_a_little_off(tmp_path: Path):
    rig, tree = near_its_limit(tmp_path, upper_deg=40.0)
    free, usual = hanging_posture(tree, 0.0), usual_friction(rig, COULOMB)[0][0]
    off = free + np.array([0.8 * OFFSET_MAX, 0.0])
    assert abs(carrying_torque(tree, off)[0]) > usual
    assert not refused_at(rig, tree, off)
    assert "an encoder that is off by 3°" in refused_at(rig, tree, free + np.array([4.0 * OFFSET_MAX, 0.0]))


@pytest.mark.parametrize("stayed", [{}, {1.0: [0.4 * MOVED], -1.0: [1.4 * MOVED]}, {1.0: [1.2 * MOVED, 0.4 * MOVED]}])
def test_a_light_joint_may_come_back_the_way_its_weight_pulls(stayed: dict[float, list[float]]):
    refuse_spring(load_rig("recupera_like_qdd"), 3, stayed)


def test_a_joint_that_comes_back_both_ways_is_a_spring():
    with pytest.raises(IdentificationError, match="both ways"):
        refuse_spring(load_rig("recupera_like_qdd"), 3, {1.0: [0.4 * MOVED], -1.0: [0.1 * MOVED]})
