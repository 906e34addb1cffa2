"""A procedure begins when the learned arm floats, follows the machine's clock, and always ends in a descent."""

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.errors import RigError
from exograv.identification.core.carried_arm import CarriedArm
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live import live_procedure
from exograv.live.arm_worker import LearnedArm
from exograv.live.live_control import MODES
from exograv.live.live_procedure import LATE, OVER, STOPPED, LiveFloat, LiveProcedure
from exograv.live.live_processes import Running
from exograv.live.worker_supervisor import WorkerKeeper
from exograv.loop.arm_controller import ArmController
from exograv.loop.floating_machine import LOOK_S, FloatingMachine
from exograv.loop.pilot import Progress
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.runtime.control_loop.exchange import FeltLevel, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import GuardLine
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.recorder.recorder_process import Inlet
from exograv.safety.guard import SafeState
from exograv.safety.modes import Mode

JOINTS, PERIOD_S = 4, 0.004


@dataclass
class ScriptedMachine:
    """Guard and control of which only the messages exist; each call of `tick` is one period."""

    states: Mailbox = field(default_factory=lambda: Mailbox(state_dtype(JOINTS)))
    answers: Mailbox = field(default_factory=lambda: Mailbox(answer_dtype(JOINTS)))
    state: np.ndarray = field(default_factory=lambda: np.zeros((), state_dtype(JOINTS)))
    answer: np.ndarray = field(default_factory=lambda: np.zeros((), answer_dtype(JOINTS)))

    def __post_init__(self):
        learned = Mock(spec=LearnedArm, carried=Mock(spec=CarriedArm))
        self.worker = Mock(spec=WorkerKeeper, learned=learned)
        self.line = Mock(spec=GuardLine)
        inlet = Mock(spec=Inlet, n_joints=JOINTS)
        self.running = Mock(
            spec=Running, states=self.states, answers=self.answers, line=self.line, worker=self.worker,
            recorder=Mock(spec=Recorder, inlet=inlet),
        )  # fmt: skip
        self.answer["mode"], self.state["persons"] = MODES.index(Mode.FLOATING), 1

    def tick(self) -> None:
        self.state["now"] += PERIOD_S
        self.answers.write(self.answer)
        self.states.write(self.state)

    def run(self, is_over: threading.Event) -> None:
        while not is_over.is_set():
            self.tick()
            time.sleep(0.003)


@pytest.fixture
def machine() -> Iterator[ScriptedMachine]:
    made, is_over = ScriptedMachine(), threading.Event()
    made.tick()
    thread = threading.Thread(target=made.run, args=(is_over,), daemon=True)
    thread.start()
    yield made
    is_over.set()
    thread.join()
    made.states.close()
    made.answers.close()


@pytest.fixture
def floating(machine: ScriptedMachine) -> Iterator[LiveFloat]:
    made = LiveFloat(machine.running, Mock(spec=ArmController), threading.Event())
    made.wait()
    yield made
    made.close()


@pytest.fixture(scope="module")
def prepared() -> ControllerKnowledge:
    return ideal_knowledge(draw_laboratory("recupera_like_qdd", None, 0, 1000), 0.0)


def test_looks_follow_the_clock_of_the_machine(floating: LiveFloat):
    seen, begin = list[float](), floating.t
    floating.float_for(0.2, lambda t, _q: bool(seen.append(t)))
    assert floating.t - begin >= 0.2
    assert np.diff(seen).min() >= LOOK_S - 1e-9


def test_a_look_can_end_a_run(floating: LiveFloat):
    begin = floating.t
    floating.float_for(60.0, lambda _t, _q: True)
    assert floating.t - begin < 1.0


def test_the_guard_decides_on_each_level_and_the_request_is_recorded(floating: LiveFloat, machine: ScriptedMachine):
    machine.state["gravity_level"] = 0.25
    floating.feel(0.5)
    machine.line.send.assert_called_once_with(FeltLevel(0.5))
    machine.running.recorder.write.assert_called_once()
    assert machine.running.recorder.write.call_args.args[2] == {"act": "level", "gravity_level": 0.5}
    floating.wait()
    floating.wait()
    assert floating.gravity_level == 0.25


def test_a_descent_ends_each_wait(floating: LiveFloat, machine: ScriptedMachine):
    machine.state["safe_state"] = SafeState.DESCENT
    with pytest.raises(RigError, match=STOPPED):
        floating.float_for(60.0, lambda _t, _q: False)


def test_the_end_of_the_time_ends_each_wait_before_the_guard_ends_its_loop(machine: ScriptedMachine):
    late = LiveFloat(machine.running, Mock(spec=ArmController), threading.Event(), 0.1)
    late.wait()
    begun = late.t
    with pytest.raises(RigError, match=LATE):
        late.float_for(60.0, lambda _t, _q: False)
    assert late.t - begun < 1.0
    late.close()


@pytest.mark.parametrize("lacks", ["person", "mode", "drive", "arm"])
def test_no_procedure_begins_before_the_known_arm_floats(lacks: str, floating: LiveFloat, machine: ScriptedMachine):
    machine.tick()
    floating.wait()
    assert floating.is_floating()
    match lacks:
        case "person":
            machine.state["persons"] = 0
        case "mode":
            machine.answer["mode"] = MODES.index(Mode.MOVING)
        case "drive":
            machine.answer["drive"] = 0.1
        case _:
            machine.worker.learned = None
    machine.tick()
    floating.wait()
    floating.wait()
    assert not floating.is_floating()


def flown(machine: ScriptedMachine, prepared: ControllerKnowledge, performs: Mock, x: np.ndarray) -> LiveProcedure:
    machine.worker.learned.carried.x = x
    made = LiveProcedure(performs, prepared, PERIOD_S, lambda _text, _share: None)
    with made:
        made.begin(machine.running)
        until = time.monotonic() + 10.0
        while not machine.running.stop.called and time.monotonic() < until:
            time.sleep(0.01)
    return made


def perform(_machine: FloatingMachine, _progress: Progress) -> None:
    """Do nothing."""


def test_the_arm_is_let_down_after_a_procedure(machine: ScriptedMachine, prepared: ControllerKnowledge):
    made = flown(machine, prepared, Mock(spec=perform), prepared.x)
    machine.running.stop.assert_called_once_with()
    assert made.has_begun
    assert made.failure is None


def test_the_arm_is_let_down_after_a_procedure_that_dies(machine: ScriptedMachine, prepared: ControllerKnowledge):
    made = flown(machine, prepared, Mock(spec=perform, side_effect=ZeroDivisionError), prepared.x)
    machine.running.stop.assert_called_once_with()
    assert isinstance(made.failure, ZeroDivisionError)


def test_no_procedure_begins_with_an_implausible_arm(machine: ScriptedMachine, prepared: ControllerKnowledge):
    performs = Mock(spec=perform)
    made = flown(machine, prepared, performs, 10.0 * prepared.x)
    performs.assert_not_called()
    machine.running.stop.assert_called_once_with()
    assert isinstance(made.failure, RigError)


def test_a_procedure_that_outlasts_its_run_has_failed(
    machine: ScriptedMachine, prepared: ControllerKnowledge, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(live_procedure, "ENDS_S", 0.1)
    goes_on = threading.Event()
    machine.worker.learned.carried.x = prepared.x
    made = LiveProcedure(lambda *_: goes_on.wait(30.0), prepared, PERIOD_S, lambda _text, _share: None)
    with made:
        made.begin(machine.running)
        until = time.monotonic() + 10.0
        while not made.has_begun and time.monotonic() < until:
            time.sleep(0.01)
    goes_on.set()
    assert made.has_begun
    assert isinstance(made.failure, RigError)


def test_a_procedure_ends_with_the_run(machine: ScriptedMachine, prepared: ControllerKnowledge):
    def floats_on(floating: FloatingMachine, _progress: Progress) -> None:
        floating.float_for(60.0, lambda _t, _q: False)

    machine.worker.learned.carried.x = prepared.x
    made = LiveProcedure(floats_on, prepared, PERIOD_S, lambda _text, _share: None)
    begin = time.monotonic()
    with made:
        made.begin(machine.running)
        while not made.has_begun:
            time.sleep(0.01)
    assert time.monotonic() - begin < 10.0
    assert str(made.failure) == OVER
