"""The motion of a live identification tells a form with a wrong body mass, after its first 20 s."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.support import assemble
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.weighing.first_motion import SECONDS
from exograv.procedures.weighing.form_check import FormCheck

SEED, STEP_S, MOTION_S = 1004, 0.01, 24.0  # A light person, whose mass in pounds is still that of an adult.
POUNDS_PER_KG = 2.2046


@pytest.fixture(scope="module")
def checked() -> Callable[[float, float], FormCheck]:
    """Return a function that moves an arm of the model, and checks it against a multiple of its body mass."""
    laboratory = draw_laboratory("recupera_like", None, 0, SEED)
    known = ideal_knowledge(laboratory, 0.0)
    model = ArmModel(known.assembly, known.machine)
    path = identification_motion(known.assembly, MOTION_S, STEP_S)

    def check(share: float, seconds: float) -> FormCheck:
        typed = replace(laboratory.body, mass_kg=share * laboratory.body.mass_kg)
        by_form = ArmModel(assemble(laboratory.description, typed), known.machine)
        form = FormCheck(by_form, typed.mass_kg)
        model.restart()
        for k in range(min(round(seconds / STEP_S), len(path))):
            asked = Sample(k * STEP_S, path.q[k], path.v[k], path.a[k], path.q[k])
            tau = model.linearise(asked, known.x)[0]
            form(Sample(k * STEP_S, path.q[k], path.v[k], path.a[k], tau))
        return form

    return check


@pytest.mark.slow
def test_a_right_form_is_accepted(checked: Callable[[float, float], FormCheck]):
    form = checked(1.0, MOTION_S)
    form.finish(False)
    assert form.verdict is not None
    assert not form.verdict.refused
    assert form.refusal == ""


@pytest.mark.slow
def test_a_mass_in_pounds_is_refused_with_what_to_check(checked: Callable[[float, float], FormCheck]):
    form = checked(POUNDS_PER_KG, MOTION_S)
    assert "may have been typed in pounds. Check body mass." in form.refusal


@pytest.mark.slow
def test_a_shorter_motion_gives_no_verdict(checked: Callable[[float, float], FormCheck]):
    form = checked(POUNDS_PER_KG, SECONDS - 1.0)
    form.finish(False)
    assert form.verdict is None
    assert form.refusal == ""
