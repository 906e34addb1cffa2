"""A live session begins off, carries the machine before the arm, and takes over the arm by a ramp."""

from dataclasses import dataclass, field
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.control.tick import SLOPE_MAX, Tick
from exograv.dynamics.parameters import ParameterLayout
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.live_control import OPERATOR, SKIPPED_TEXT, LiveControl, LivePlan, guarded_rig, notes
from exograv.live.live_identification import LiveIdentification
from exograv.live.procedure_orders import Order, OrderedMotion
from exograv.loop.person_limits import person_limits
from exograv.loop.phases import FLOATING
from exograv.rig.twin import Twin
from exograv.runtime.control_loop.exchange import answer_dtype, state_dtype
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, SafeState
from exograv.safety.modes import RAMP_IN_S, REST_BEFORE_RAMP_S, Mode, ModeMachine
from exograv.signals import Command

SEED, LEVEL = 1001, 1
DRIFT_MAX_DEG = 0.5  # A tenth of the deviation that interrupts a ramp.
HELD_NM = 2.0  # Torque of this arm near the hanging posture.
FELL_DEG = 10.0


@dataclass
class Course:
    """Record of each tick."""

    modes: list[Mode] = field(default_factory=list)
    asked: list[np.ndarray] = field(default_factory=list)
    q: list[np.ndarray] = field(default_factory=list)
    muscle: list[float] = field(default_factory=list)


def flown(seconds: float, holds: bool = True, stop_at_s: float | None = None) -> Course:
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    prepared = ideal_knowledge(laboratory, 0.0)
    person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    plan = LivePlan(
        laboratory.description,
        laboratory.form,
        prepared,
        person,
        0.0,
        cooperative_machine(laboratory, SEED, prepared.t),
    )
    made, control, joints = guarded_rig(plan), LiveControl(prepared, 0.0), prepared.assembly.n
    rig, twin, guard = made.rig, made.rig._twin, made.guard  # pyright: ignore[reportAttributeAccessIssue]
    assert isinstance(twin, Twin)
    if not holds:
        rig._grip._holds = False  # pyright: ignore[reportAttributeAccessIssue]
    state, row, course = np.zeros(1, state_dtype(joints))[0], np.zeros((), answer_dtype(joints)), Course()
    safe_state, stop_tick = SafeState.NONE, None if stop_at_s is None else round(stop_at_s / rig.period_s)
    for k in range(round(seconds / rig.period_s)):
        if k == stop_tick:
            guard.press_stop()
        now, measured = rig.t, rig.read()
        believed = guard.see(measured, now)
        assert believed is not None
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, safe_state
        state["q"], state["current"] = believed.q, believed.current
        control.answer(state, row)
        guarded = guard.decide(ControlRequest(believed.sequence, now + COMMAND_LIFE_S, row["tau"].copy()), now)
        tau = guarded.tau
        rig.write(Command(now, measured.sequence, now + COMMAND_LIFE_S, tau, tau / made.gain, guarded.drive_damping))
        safe_state = guarded.safe_state
        if guard.envelope.stop is not None:
            guard.reset()
        course.modes.append(control.mode)
        course.asked.append(row["tau"].copy())
        course.q.append(measured.q)
        course.muscle.append(float(np.abs(twin.tau_voluntary).max()))
    return course


def entered(modes: list[Mode]) -> list[tuple[Mode, float]]:
    changes = [k for k in range(len(modes)) if k == 0 or modes[k] is not modes[k - 1]]
    return [(modes[k], 1e-3 * k) for k in changes]


@pytest.fixture(scope="module")
def course() -> Course:
    return flown(REST_BEFORE_RAMP_S + RAMP_IN_S + 2.5)


@pytest.mark.slow
def test_it_goes_by_the_table_from_off_to_floating(course: Course):
    found = entered(course.modes)
    assert [mode for mode, _ in found] == [Mode.OFF, Mode.SELF_TEST, Mode.EXO_ONLY, Mode.RAMP_IN, Mode.FLOATING]
    began = dict(found)
    assert began[Mode.RAMP_IN] - began[Mode.EXO_ONLY] == pytest.approx(REST_BEFORE_RAMP_S, abs=0.01)
    assert began[Mode.FLOATING] - began[Mode.RAMP_IN] == pytest.approx(RAMP_IN_S, abs=0.01)


@pytest.mark.slow
def test_before_it_carries_itself_the_machine_is_asked_for_nothing(course: Course):
    asked = [tau for tau, mode in zip(course.asked, course.modes, strict=True) if mode in (Mode.OFF, Mode.SELF_TEST)]
    assert asked
    assert all((tau == 0.0).all() for tau in asked)


@pytest.mark.slow
def test_the_person_holds_the_arm_until_the_machine_has_taken_it_and_then_lets_go(course: Course):
    at = {mode: course.modes.index(mode) for mode in set(course.modes)}
    assert course.muscle[at[Mode.RAMP_IN] - 1] > HELD_NM
    assert course.muscle[-1] == 0.0
    taken = np.array(course.q[: at[Mode.FLOATING]])
    way = np.rad2deg(np.abs(taken - taken[0]).max())
    assert way < DRIFT_MAX_DEG


@pytest.mark.slow
def test_an_arm_that_nobody_holds_is_not_taken_where_it_falls():
    course = flown(3.0, holds=False)
    assert np.rad2deg(np.abs(course.q[-1] - course.q[0]).max()) > FELL_DEG
    assert max(course.muscle) == 0.0
    assert Mode.FLOATING not in course.modes


@pytest.mark.slow
def test_after_a_stop_it_begins_again_from_off_and_takes_the_arm_by_a_ramp():
    course = flown(20.0, stop_at_s=7.5)
    found = [mode for mode, _ in entered(course.modes)]
    assert found[-6:] == [Mode.SAFE, Mode.OFF, Mode.SELF_TEST, Mode.EXO_ONLY, Mode.RAMP_IN, Mode.FLOATING]


def test_a_posture_that_was_lost_is_found_anew_when_the_guard_has_stopped():
    prepared = ideal_knowledge(draw_laboratory("recupera_like", None, LEVEL, SEED), 0.0)
    control, joints = LiveControl(prepared, 0.0), prepared.assembly.n
    state, row = np.zeros(1, state_dtype(joints))[0], np.zeros((), answer_dtype(joints))
    state["q"] = prepared.assembly.description.donning_posture
    for safe_state in [SafeState.NONE] * 3:
        state["safe_state"] = safe_state
        control.answer(state, row)
    control._controller._tick._in["z_before"][:] = np.nan
    control.answer(state, row)
    assert not np.isfinite(row["slope"])
    for safe_state in (SafeState.DESCENT, SafeState.NONE, SafeState.NONE):
        state["safe_state"] = safe_state
        control.answer(state, row)
    assert row["slope"] < 1e-6
    assert np.isfinite(row["tau"]).all()


def test_a_self_test_that_is_not_done_is_said_to_be_skipped():
    assert notes(is_tested=False) == {"self_test": SKIPPED_TEXT}
    assert notes(is_tested=True) == {}


def test_the_virtual_operator_only_does_what_the_table_allows_and_ends_with_the_machine_alone():
    modes = ModeMachine(Mode.SAFE)
    passed = [modes.mode]
    while modes.mode in OPERATOR:
        assert modes.take(OPERATOR[modes.mode])
        passed.append(modes.mode)
    assert passed == [Mode.SAFE, Mode.OFF, Mode.SELF_TEST, Mode.EXO_ONLY]
    assert modes.arm_share == 0.0


def test_the_first_answer_after_the_preparation_solves_no_closure_from_a_cold_start(monkeypatch: pytest.MonkeyPatch):
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    prepared = ideal_knowledge(laboratory, 0.0)
    control, joints = LiveControl(prepared, 0.0), prepared.assembly.n
    state, row = np.zeros(1, state_dtype(joints))[0], np.zeros((), answer_dtype(joints))
    state["q"] = prepared.assembly.description.donning_posture
    control.prepare(state)
    cold: list[np.ndarray] = []
    monkeypatch.setattr(Tick, "close", lambda _tick, q, _x: cold.append(q))
    control.answer(state, row)
    assert control.mode is Mode.OFF
    assert not cold
    assert row["slope"] < SLOPE_MAX


def test_a_preparation_leaves_no_trace_in_the_modes_and_in_the_torque():
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    prepared = ideal_knowledge(laboratory, 0.0)
    joints, rows = prepared.assembly.n, []
    for is_prepared in (True, False):
        control, state = LiveControl(prepared, 0.0), np.zeros(1, state_dtype(joints))[0]
        state["q"] = prepared.assembly.description.donning_posture
        if is_prepared:
            control.prepare(state)
        row = np.zeros((), answer_dtype(joints))
        for k in range(100):
            state["now"], state["sequence"] = 1e-3 * k, k
            control.answer(state, row)
        rows.append(row)
    assert rows[0]["mode"] == rows[1]["mode"]
    np.testing.assert_allclose(rows[0]["tau"], rows[1]["tau"], atol=1e-9)


def carried(order: Order) -> tuple[LiveControl, OrderedMotion, list[np.ndarray]]:
    """Control with a floating arm that takes an order, after three ticks, and what it tells the procedure."""
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    prepared, waiting, told = ideal_knowledge(laboratory, 0.0), [order], list[np.ndarray]()
    motion = OrderedMotion(
        laboratory.description, 1e-3, lambda: waiting.pop(0) if waiting else None, lambda row: told.append(row.copy())
    )
    lesson = Mock(spec=LiveIdentification, findings=0)
    lesson.found.return_value, lesson.phase.return_value = None, FLOATING
    control = LiveControl(prepared, 0.0, orders=motion, lesson=lesson)
    control.forget(Mode.FLOATING, 1.0)
    state = np.zeros(1, state_dtype(prepared.assembly.n))[0]
    row = np.zeros((), answer_dtype(prepared.assembly.n))
    state["q"] = np.mean(laboratory.description.workspace, axis=0)
    state["persons"] = 1
    for k in range(3):
        state["sequence"], state["now"] = k + 1, 1e-3 * k
        control.answer(state, row)
        control.afterwards()
    return control, motion, told


@pytest.mark.parametrize("factor", [1.05, 50.0])
def test_control_carries_the_arm_of_an_order_by_a_ramp_and_tells_the_procedure_of_one_that_it_refuses(factor: float):
    x = ideal_knowledge(draw_laboratory("recupera_like", None, LEVEL, SEED), 0.0).x
    other = x.copy()
    other[: ParameterLayout.of(draw_laboratory("recupera_like", None, LEVEL, SEED).assembly()).phi.stop] *= factor
    control, _, told = carried(Order(7, True, x=tuple(other.tolist())))
    is_refused = factor > 2.0
    assert (int(told[-1]["refused"]) == 7) == is_refused
    assert np.array_equal(control._controller.x, x) == is_refused
    away = np.abs(control._controller.x - x).max()
    assert away < 0.1 * np.abs(other - x).max()
