"""An arm that is identified live passes unseen postures before it floats, and the measured residual torque is true."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.live.arm_worker import ArmWorker, LearnedArm, PassesResult
from exograv.live.live_control import LiveControl, LivePlan, guarded_rig
from exograv.live.live_identification import LiveIdentification, lesson_passes, unknown_person
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.verification.postures import Verification, unseen_postures
from exograv.procedures.verification.verification import evaluate_passes
from exograv.runtime.control_loop.exchange import answer_dtype, finding_dtype, state_dtype
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, SafeState
from exograv.safety.modes import Mode
from exograv.safety.person import GuardedPerson
from exograv.signals import Command

SEED, LEVEL = 1004, 1
PERIOD_S, MOTION_S, POSTURES = 0.001, 10.0, 2
MOST_S = 120.0
RESIDUAL_NM, RESIDUAL_S = 0.1, 0.1  # Values of a perfectly calibrated machine.
INSIDE = 3  # Out of four joints. One person proves no coverage.


@dataclass
class Course:
    """Guard, control and worker in one process, on the twin's clock."""

    modes: list[Mode] = field(default_factory=list)
    words: list[LearnedArm | PassesResult] = field(default_factory=list)
    driven: list[bool] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)


def known_machine(laboratory: VirtualLaboratory) -> ControllerKnowledge:
    """Knowledge of the machine without a calibration, which is not tested here. The wearer is unknown."""
    prepared = ideal_knowledge(laboratory, 0.0)
    assembly = laboratory.assembly()
    joints = np.ones(assembly.n)
    machine = replace(prepared.machine, residual_sd=RESIDUAL_NM * joints, correlation_s=RESIDUAL_S * joints)
    return replace(prepared, assembly=assembly, machine=machine, x=table_guess(assembly, machine))


def flown(laboratory: VirtualLaboratory, prepared: ControllerKnowledge, asked: Verification) -> Course:
    assembly, machine, course = prepared.assembly, prepared.machine, Course()
    made = guarded_rig(
        LivePlan(
            laboratory.description,
            laboratory.form,
            prepared,
            unknown_person(assembly, machine),
            0.0,
            cooperative_machine(laboratory, SEED, prepared.t),
        )
    )
    guard, rig = made.guard, made.rig
    worker = ArmWorker(assembly, machine, PERIOD_S, is_verified=True)
    found, newest = 0, np.zeros(1, finding_dtype(len(prepared.x)))[0]
    persons = 0

    def tell(sample: np.ndarray) -> None:
        nonlocal found, persons
        x = worker.take(sample[()])  # pyright: ignore[reportArgumentType] - a row without dimension
        if sample["is_last"]:
            x, word = worker.finish()
            course.words.append(word)
            person = GuardedPerson(word.person, 0.0)
            person.drive(word.is_led)
            guard.envelope.person, persons = person, persons + 1
        if x is not None:
            found, newest["now"], newest["x"] = found + 1, sample["now"], x

    passes = lesson_passes(assembly, MOTION_S, PERIOD_S, asked)
    lesson = LiveIdentification(assembly, MOTION_S, PERIOD_S, tell, lambda: (found, newest) if found else None, passes)
    assert guard.envelope.person is not None
    guard.envelope.person.drive(True)
    control = LiveControl(prepared, 0.0, lesson=lesson, period_s=PERIOD_S)
    state, row = np.zeros(1, state_dtype(assembly.n))[0], np.zeros((), answer_dtype(assembly.n))
    safe_state, floats = SafeState.NONE, 0
    while rig.t < MOST_S and floats < 1.0 / PERIOD_S and guard.envelope.stop is None:
        now, measured = rig.t, rig.read()
        believed = guard.see(measured, now)
        assert believed is not None
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, safe_state
        state["q"], state["current"], state["persons"] = believed.q, believed.current, persons
        control.answer(state, row)
        guarded = guard.decide(ControlRequest(believed.sequence, now + COMMAND_LIFE_S, row["tau"].copy()), now)
        tau, safe_state = guarded.tau, guarded.safe_state
        rig.write(Command(now, measured.sequence, now + COMMAND_LIFE_S, tau, tau / made.gain, guarded.drive_damping))
        course.modes.append(control.mode)
        course.driven.append(bool(row["drive"] > 0.0))
        floats += control.mode is Mode.FLOATING and persons > 1
    course.stops = [] if guard.envelope.stop is None else [guard.envelope.stop.value]
    return course


@pytest.mark.slow
def test_who_is_learned_is_led_past_every_posture_and_what_is_left_over_holds_the_truth():
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    prepared = known_machine(laboratory)
    model = ArmModel(prepared.assembly, prepared.machine)
    seen = identification_motion(prepared.assembly, MOTION_S, 0.05).q
    asked = Verification(unseen_postures(model.again(), prepared.x, seen, SEED)[:POSTURES], SEED)
    course = flown(laboratory, prepared, asked)
    assert not course.stops
    learned, passed = course.words
    assert isinstance(learned, LearnedArm)
    assert isinstance(passed, PassesResult)
    assert {one.posture for one in passed.heard} == set(range(POSTURES))
    assert course.modes[-1] is Mode.FLOATING
    assert not course.driven[-1]
    verified = evaluate_passes(
        model, learned.estimate, asked.postures, passed.heard, passed.seconds, lambda _text, _share: None
    )
    truth = Examination(laboratory, prepared.assembly, prepared.machine, asked.postures)
    total = truth.score(learned.estimate.x).total
    _, low, high = verified.rms
    assert ((low <= total) & (total <= high)).sum() >= INSIDE
