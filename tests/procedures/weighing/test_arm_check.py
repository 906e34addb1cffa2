"""Check of the arm: the right form is accepted, mixed-up units are found, and the operator gets the next step."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.support import sample_postures
from exograv.procedures.weighing.arm_check import POUNDS_PER_KG, SURE, ArmCheck, ArmJudge
from exograv.procedures.weighing.weighing_path import informative_path

BODY_KG = 75.0  # as in conftest.py
PATH_DT = 0.02
RESTLESS = 2.7  # an ordinary day: 0.8 N·m at the shoulder


@pytest.fixture(scope="module")
def samples(model, believed_arm, heard):
    x, _ = believed_arm
    postures = sample_postures(model.assembly.description, 16)[1:]
    way = informative_path(model, x, x[ParameterLayout.of(model.assembly).phi], 0.35, postures)
    return heard(way.cycles(18.0, PATH_DT).table(), x, 1000, RESTLESS)


def judged(model, samples, factor: float) -> ArmCheck:
    """Return the check with a body mass on the form that is wrong by a factor."""
    arm = model.assembly.arm
    typed = copy.copy(model)
    wrong = replace(arm, phi=factor * arm.phi, phi_covariance=factor**2 * arm.phi_covariance)
    typed.assembly = replace(model.assembly, arm=wrong)
    return ArmJudge(typed).judge([samples], factor * BODY_KG)


def test_the_right_form_is_believed_and_the_interval_holds_the_arm(model, believed_arm, samples):
    check = judged(model, samples, 1.0)
    mass = sum(believed_arm[0][body.start] for body in ParameterLayout.of(model.assembly).bodies)
    assert not check.refused
    assert check.ci95[0] < mass < check.ci95[1]


@pytest.mark.parametrize(("factor", "word"), [(POUNDS_PER_KG, "in pounds"), (1 / POUNDS_PER_KG, "kilograms again")])
def test_mixed_up_units_are_refused_with_what_to_check(model, samples, factor: float, word: str):
    check = judged(model, samples, factor)
    assert check.refused
    assert word in check.why
    assert f"not {factor * BODY_KG:.0f} kg" in check.why
    assert abs(np.log(check.like_kg / BODY_KG)) < 0.3


def test_somebody_elses_form_is_named_as_such(model, samples):
    check = judged(model, samples, 4.0)
    assert check.refused
    assert check.why.endswith(".")


def test_a_form_a_little_off_is_no_reason_to_refuse(model, samples):
    assert not judged(model, samples, 1.1).refused


def test_two_motions_say_more_than_one_of_them(model, samples):
    judge = ArmJudge(model)
    one, both = judge.judge([samples], BODY_KG), judge.judge([samples, samples], BODY_KG)
    assert both.sd < one.sd
    wrong = judged(model, samples, 1 / POUNDS_PER_KG)
    assert 0.5 < wrong.probability <= 1.0


@pytest.mark.parametrize(("probability", "sure"), [(SURE - 1e-6, False), (SURE, True), (1.0, True)])
def test_a_verdict_is_sure_from_99_to_1_on(probability: float, sure: bool):
    assert ArmCheck(3.0, 0.2, 75.0, True, "", probability).is_sure == sure
