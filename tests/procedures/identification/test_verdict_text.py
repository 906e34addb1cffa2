"""The operator is told which joint disagrees or is carried in part, by how much, and what to do next."""

import numpy as np

from exograv.identification.core.carried_arm import CarriedArm
from exograv.identification.core.interface import Agreement, Estimate, Outcome
from exograv.model.description import load_rig
from exograv.procedures.identification.verdict_text import carried_text, check_text, slip_text

RIG = load_rig("recupera_like")


def check(p: list[float]) -> Agreement:
    return Agreement(np.array(p), np.array([0.1, 0.62, 0.1, 0.1]), np.full(4, 0.25), 0.0025)


def test_a_disagreement_names_joint_torque_and_next_step():
    text = check_text(Outcome.DISAGREES, check([0.4, 0.001, 0.4, 0.4]), RIG.joints)
    for part in (RIG.joints[1], "0.62", "0.25", "0.1 %", "identify again"):
        assert part in text


def test_an_agreement_asks_for_nothing():
    assert "again" not in check_text(Outcome.CONVERGED, check([0.4, 0.2, 0.4, 0.4]), RIG.joints)


def test_a_missing_check_names_the_motion_that_has_one_where_only_the_check_is_missing():
    assert "40 s" in check_text(Outcome.UNCHECKED, None, RIG.joints)
    assert check_text(Outcome.EXHAUSTED, None, RIG.joints) == ""


def test_slip_is_told_only_where_its_torque_matters():
    estimate = Estimate(60.0, np.zeros(1), np.eye(1), 0.0, 1.0, np.array([0.009, 0.001]))
    assert slip_text(estimate, np.array([0.09, 0.0, 0.0, 0.04]), RIG) == ""
    text = slip_text(estimate, np.array([0.09, 0.0, 0.0, 0.08]), RIG)
    assert "9 mm" in text
    assert RIG.joints[3] in text


def carried(share: list[float], stated: float = 0.2) -> CarriedArm:
    change, bound = np.array([0.9, 0.31, 0.12, 0.8]), np.array([0.3, 0.29, 0.24, 0.2])
    return CarriedArm(np.zeros(1), np.eye(1), np.array(share), change, bound, np.full(4, stated), np.full(4, 0.45))


def test_an_arm_that_is_carried_in_full_needs_no_sentence():
    assert carried_text(carried([1.0, 1.0, 1.0, 1.0]), RIG.joints, 60.0) == ""


def test_each_axis_that_is_carried_in_part_is_named_with_its_figures():
    text = carried_text(carried([1.0, 0.62, 1.0, 1.0]), RIG.joints, 60.0)
    for part in (RIG.joints[1], "0.31", "0.29", "62 %"):
        assert part in text
    for joint in (RIG.joints[0], RIG.joints[2], RIG.joints[3]):
        assert joint not in text


def test_the_next_step_is_a_full_motion_after_a_short_one_and_better_conditions_after_a_full_one():
    part = carried([1.0, 0.62, 1.0, 1.0])
    assert "motion of 60 s" in carried_text(part, RIG.joints, 20.0)
    assert "Check the cuffs" in carried_text(part, RIG.joints, 59.8)


def test_an_axis_on_which_the_table_states_less_is_told_so():
    text = carried_text(carried([1.0, 0.1, 1.0, 1.0], stated=0.5), RIG.joints, 60.0)
    assert "may leave 0.50 N·m over, the table 0.45 N·m" in text
