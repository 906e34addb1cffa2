"""The operator is told which joint disagrees, by how much, and what to do next."""

import numpy as np

from exograv.identification.core.interface import Agreement, Estimate, Outcome
from exograv.model.description import load_rig
from exograv.procedures.identification.verdict_text import check_text, slip_text

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
