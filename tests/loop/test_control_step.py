"""Every run of a machine uses the same single implementation of the control step."""

import ast
from pathlib import Path

import numpy as np
import pytest
from tests.syntax import nodes_of

import exograv
from exograv.loop.control_step import CLOSURE_SLOPE_MAX, NO_MEASUREMENT, ControlStep
from exograv.loop.output_feedback import NoTorque, OutputFeedback
from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, Guard, SafeState
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason
from exograv.signals import JointState, Reference, TorqueSource

SOURCE = Path(exograv.__file__).parent
DT = 0.001
GAIN = np.array([2.0])


class Asking(NoTorque):
    """Controller with a constant torque and a given slope of its loops."""

    closure_slope = 0.0

    def __init__(self, tau: float):
        super().__init__(1)
        self.tau_feedforward[:] = tau


@pytest.fixture
def guard() -> Guard:
    limits = Limits(np.array([30.0]), np.array([1.0]), descent_s=0.05)
    return Guard.of_machine(Envelope(limits, DT), DT, is_known=False)


@pytest.fixture
def step(guard: Guard) -> ControlStep:
    return ControlStep(guard, GAIN)


def measured(k: int) -> JointState:
    return JointState(k * DT, k, np.zeros(1), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)


def calls_of_a_guard(module: Path) -> set[str]:
    """Calls of the guard's halves of a tick in a module: `decide` of anything, `see` of an object called a guard."""
    found, text = set[str](), module.read_text(encoding="utf-8")
    if not any(word in text for word in ("decide", "lose_model", "guard")):
        return found
    for node in nodes_of(module):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        receiver, name = ast.unparse(node.func.value), node.func.attr
        if name in {"decide", "lose_model"} or (name in {"see", "step"} and receiver.endswith("guard")):
            found.add(name)
    return found


def test_a_control_step_is_written_once():
    modules = [path for path in SOURCE.rglob("*.py") if path.relative_to(SOURCE).parts[0] != "safety"]
    assert len(modules) > 500
    found = {path.relative_to(SOURCE).as_posix(): calls for path in modules if (calls := calls_of_a_guard(path))}
    assert found == {"loop/control_step.py": {"see", "decide", "lose_model"}}


def test_what_control_asks_for_goes_out_as_torque_and_current(step: ControlStep):
    control = OutputFeedback(1, DT, Asking(0.4))
    for k in range(49):
        step.take(measured(k), k * DT, control)
    decision = step.take(measured(49), 49 * DT, control)
    command = decision.command
    assert command.tau == pytest.approx(0.4)
    assert command.current == pytest.approx(0.4 / GAIN)
    assert (command.t, command.sequence, command.valid_until) == (49 * DT, 49, 49 * DT + COMMAND_LIFE_S)
    assert decision.safe_state is SafeState.NONE


def test_a_measurement_that_is_not_there_is_not_answered(step: ControlStep):
    control = OutputFeedback(1, DT, Asking(0.4))
    step.take(measured(0), 0.0, control)
    decision = step.take(None, DT, control)
    assert decision.believed is None
    assert decision.submitted is None
    assert decision.command.sequence == NO_MEASUREMENT
    assert decision.safe_state is SafeState.BRIDGE


@pytest.mark.parametrize("slope", [CLOSURE_SLOPE_MAX, np.nan])
def test_a_model_whose_loops_are_open_stops_the_machine_from_the_next_step_on(
    guard: Guard, step: ControlStep, slope: float
):
    asking = Asking(0.4)
    control = OutputFeedback(1, DT, asking)
    step.take(measured(0), 0.0, control)
    asking.closure_slope = slope
    decision = step.take(measured(1), DT, control)
    assert (decision.stop, decision.safe_state) == (None, SafeState.NONE)
    assert guard.envelope.stop is StopReason.MODEL_LOST
    assert step.take(measured(2), 2 * DT, control).safe_state is SafeState.DESCENT


def test_a_guide_is_asked_in_each_step_for_what_is_followed():
    control, told = OutputFeedback(1, DT), Reference(*np.full((3, 1), 0.7))
    control.guide = lambda q, v: told
    control.step(np.array([0.3]))
    assert control.reference is told
    assert control.q == pytest.approx(0.3)


def test_forgetting_begins_at_the_next_measurement():
    control = OutputFeedback(1, DT)
    for q in np.linspace(0.0, 0.5, 20):
        control.step(np.array([q]))
    assert control.v > 0.0
    control.forget()
    control.step(np.array([2.0]))
    assert (control.q, control.v) == (2.0, 0.0)
