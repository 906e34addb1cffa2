"""Self-test: every fault is refused with the next step, and a sound machine passes in a minute."""

import pytest

from self_test_faults import HIDDEN

SCRIPT = "tested.py"
BUSY_MAX_S = 60.0  # docs/explanation/safety.md, start-up self-test
QUICK = {
    "encoder reversed": ("encoders agree", "farther apart than in the calibration"),
    "encoder off by 5°": ("encoders agree", "'elbow_flexion'"),
    "motor's encoder off by 5°": ("encoders agree", "'shoulder_abduction'"),
    "current sensor off by 2.5 N·m": ("torque zero", "'shoulder_rotation' reports +2."),
    "measurements come late": ("encoders and zeros at rest", "The run was stopped"),
}
SLOW = {
    "motor gives half its torque": ("", "'shoulder_flexion'"),
    "motor gives twice its torque": ("", "'shoulder_abduction'"),
    "motor turns the other way": ("sign of each joint", "counts the other way round"),
    "both encoders reversed": ("sign of each joint", "'shoulder_rotation'"),
    "both encoders off by 10°": ("encoder offset by weight", "'elbow_flexion'"),
    "current loop off by 2.5 N·m": ("", "'shoulder_flexion'"),
    "watchdog does not trip": ("torque left without commands", "continues to give torque without commands"),
    "watchdog does not brake": ("drives brake without commands", "an arm would fall"),
    "Stop does nothing": ("Stop is heard", "Stop does not stop the machine"),
    "Stop does not reach the drives": ("torque left after Stop", "Stop does not stop the machine"),
    "encoder is dead": ("sign of each joint", "encoders of a joint and of its motor disagree"),
    "encoders swapped": ("sign of each joint", "is swapped with another"),
    "motors swapped": ("sign of each joint", "swapped"),
    "joints swapped": ("", "swapped"),
}


@pytest.mark.parametrize("fault", QUICK)
def test_what_shows_at_rest_is_refused_before_anything_moves(quick: dict, fault: str):
    step, sentence = QUICK[fault]
    assert quick[fault]["failed"][0] == step
    assert sentence in quick[fault]["what_to_do"]
    assert "sign of each joint" in quick[fault]["not_tried"]


@pytest.mark.slow
@pytest.mark.parametrize("fault", SLOW)
def test_what_shows_in_motion_is_refused(slow: dict, fault: str):
    step, sentence = SLOW[fault]
    assert slow[fault]["failed"]
    assert step in slow[fault]["failed"] or not step
    assert sentence in slow[fault]["what_to_do"]


@pytest.mark.slow
def test_a_machine_in_good_order_passes_within_a_minute(slow: dict):
    assert slow["nothing"]["failed"] == slow["nothing"]["not_tried"] == []
    assert slow["nothing"]["busy_s"] <= BUSY_MAX_S


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["nesm_like", "agree_like", "recupera_like_7", "recupera_like_qdd"])
def test_every_shipped_machine_in_good_order_passes(slow: dict, rig: str):
    """Check every shipped machine. One of them hangs on a joint stop, and is pushed off it first."""
    assert slow[rig]["failed"] == slow[rig]["not_tried"] == []


def test_every_fault_of_the_campaign_has_a_number_or_is_about_wiring():
    assert {hidden.fault for hidden in HIDDEN.values()} == {"F02", "F05", "F07", "F08", "F09", "F10", "F13", "F30", "–"}
    unproven = set(HIDDEN) - set(QUICK) - set(SLOW)
    # These are larger and smaller variants of faults above.
    assert unproven == {"encoder off by 10°", "both encoders off by 5°"}
