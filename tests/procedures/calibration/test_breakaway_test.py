"""Breakaway test: a machine that differs from its files is refused with joint and value, without a runaway."""

import numpy as np
import pytest

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import IdentificationError
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.breakaway_checks import MOVED, refuse_restless, refuse_spring
from exograv.procedures.calibration.breakaway_test import BreakawayTester, starting_posture
from exograv.procedures.calibration.empty_run import EmptyRun
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


@pytest.mark.parametrize("stayed", [{}, {1.0: [0.4 * MOVED], -1.0: [1.4 * MOVED]}, {1.0: [1.2 * MOVED, 0.4 * MOVED]}])
def test_a_light_joint_may_come_back_the_way_its_weight_pulls(stayed: dict[float, list[float]]):
    refuse_spring(load_rig("recupera_like_qdd"), 3, stayed)


def test_a_joint_that_comes_back_both_ways_is_a_spring():
    with pytest.raises(IdentificationError, match="both ways"):
        refuse_spring(load_rig("recupera_like_qdd"), 3, {1.0: [0.4 * MOVED], -1.0: [0.1 * MOVED]})
