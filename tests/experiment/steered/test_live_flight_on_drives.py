"""Motors of a machine on drives go on when an operator makes it ready, and off when nobody steers or needs them."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from tests.waiting import wait_until

from exograv.experiment.steered import live_session, process_state
from exograv.experiment.steered.flight_rests import FlightRests
from exograv.experiment.steered.live_session import LiveFlight
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.requests import DonRequest
from exograv.live.live_control import LivePlan
from exograv.live.live_processes import LiveResult, Running
from exograv.model.description import load_rig
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.runtime.control_loop.steering import GuardRequest
from exograv.safety.modes import Event, Mode
from exograv.safety.stops import StopReason
from exograv.storage.rests_so_far import RestsSoFar

SOON_S = 10.0


@dataclass
class Processes:
    """Replacement of guard, control and recorder: a guard whose answer to requests the test sets."""

    mode: Mode = Mode.OFF
    obeys: bool = True
    """True if the guard takes requests; it does not while no page steers."""
    runs: int = 0
    """Number of starts of the processes, which switch the motors on."""
    is_on: bool = False
    asked: list[Event] = field(default_factory=list)
    ended: threading.Event = field(default_factory=threading.Event)
    rests_before: list[RestsSoFar] = field(default_factory=list)
    """Rests before each start of the processes."""

    def send(self, word: object) -> None:
        if isinstance(word, GuardRequest):
            self.asked.append(word.event)
            if self.obeys:
                self.mode = {Event.TEST: Mode.EXO_ONLY, Event.SWITCH_OFF: Mode.OFF}[word.event]

    def stop(self) -> None:
        self.ended.set()

    def fly(
        self, _parts: object, _s: float, recorder: Any, progress: Any, started: Any, *_: object, **__: object
    ) -> Any:
        self.runs, self.is_on, self.mode = self.runs + 1, True, Mode.OFF
        self.ended.clear()
        control = SimpleNamespace(restarts=0)
        running = Mock(spec=Running, recorder=recorder, control=control, worker=None, line=self)
        running.stop = lambda: self.stop()  # noqa: PLW0108 - a test replaces `stop`
        started(running)
        while not self.ended.wait(0.01):
            progress("Floating live", 0.0)
        self.is_on = False
        return Mock(spec=LiveResult)


@dataclass
class Machine:
    """Machine on drives without drives."""

    description: Any = field(default_factory=lambda: load_rig("recupera_like"))
    torque_max_Nm: tuple[float, ...] = (1.0,)
    calibrating: None = None
    is_twin: bool = False
    starts_on_request: bool = True
    side: str = "right"
    form: None = None
    cause: str = ""
    is_closed: bool = False
    codes: tuple[str, ...] = ()
    refuted: tuple[str, ...] = ()

    @property
    def people(self) -> Any:
        plan = Mock(spec=LivePlan, prepared=self.prepare(), period_ns=1_000_000, description=self.description)
        return SimpleNamespace(plan=lambda *_: plan, codes=self.codes, refuted=self.refuted, keep=lambda *_: None,
                               keep_rests=lambda *_: None)  # fmt: skip

    def prepare(self) -> Any:
        return Mock(spec=ControllerKnowledge, assembly=None, machine=None, x=None)

    def machine_key(self) -> None: ...

    def rig(self, _prepared: object) -> Callable[[], None]:
        return lambda: None

    def recorded(self) -> dict[str, Any]:
        return {}

    def hear(self, _mode: str) -> None: ...

    def ended(self, _flown: object) -> str:
        return self.cause

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch) -> Processes:
    made = Processes()

    class View:
        newest = None
        safe_state = "none"

        def __init__(self, _inlet: object): ...

        @property
        def latch(self) -> str | None:
            return StopReason.STOP_PRESSED.value if made.ended.is_set() else None  # the guard's name for any end

        @property
        def mode(self) -> Mode:
            return made.mode

        def look(self) -> None:
            # A row without values is enough: only its presence and its clock are read.
            self.newest = {"now": 0.0, "monotonic": time.monotonic()}

        def close(self) -> None: ...

        def lateness(self) -> None: ...

    no_rests = Mock(spec=FlightRests, is_active=False)
    no_rests.view.return_value = no_rests.work.return_value = None
    no_rests.before_take.return_value = ""
    no_rests.so_far = RestsSoFar(rests=2, left_out=1, motion_s=10.0)
    recorder = contextlib.nullcontext(SimpleNamespace(inlet=None, check=lambda: None))
    monkeypatch.setattr(live_session, "Recorder", lambda *_, **__: recorder)
    for name, replacement in (
        ("fly", made.fly), ("FlightMemoryView", View), ("ArmController", lambda *_: Mock()),
        ("LiveRests", lambda *given: made.rests_before.append(given[3])), ("FlightRests", lambda *_: no_rests),
        ("parts_of", lambda *_, **__: None), ("settings_of", lambda *_: {}),
        ("told", lambda _row, n: process_state.told(None, n)),
    ):  # fmt: skip
        monkeypatch.setattr(live_session, name, replacement)
    return made


@pytest.fixture
def machine() -> Machine:
    return Machine()


@pytest.fixture
def flight(processes: Processes, machine: Machine, tmp_path: Path) -> Iterator[LiveFlight]:
    made = LiveFlight(SteeredOptions(participant="P-07"), tmp_path, lambda _side: machine)  # type: ignore[arg-type,return-value]
    wait_until(lambda: made._state.is_waiting, "the machine that waits", SOON_S)
    yield made
    made.close()


def test_no_process_starts_before_an_operator_makes_the_machine_ready(flight: LiveFlight, processes: Processes):
    assert flight.ask(Event.TAKE_ARM) != ""
    flight.stop()
    time.sleep(0.2)
    assert processes.runs == 0
    assert flight.ask(Event.TEST) == ""
    wait_until(lambda: processes.mode is Mode.EXO_ONLY, "the first step", SOON_S)
    assert processes.runs == 1
    assert processes.asked[0] is Event.TEST


def test_a_machine_that_is_switched_off_has_its_motors_off_and_waits_again(flight: LiveFlight, processes: Processes):
    flight.ask(Event.TEST)
    wait_until(lambda: processes.mode is Mode.EXO_ONLY, "the first step", SOON_S)
    wait_until(lambda: flight._state.has_begun, "the parent's look", SOON_S)
    processes.send(GuardRequest(1, Event.SWITCH_OFF))
    wait_until(lambda: flight._state.is_waiting, "the machine that waits", SOON_S)
    assert not processes.is_on
    flight.ask(Event.TEST)
    wait_until(lambda: processes.runs == 2, "the second run", SOON_S)
    assert flight._state.who.code == "P-07", "the arm is stored under the code that was asked for"


def off_and_on(flight: LiveFlight, processes: Processes) -> None:
    """Make the machine ready, and switch it off."""
    flight.ask(Event.TEST)
    wait_until(lambda: flight._state.has_begun, "the parent's look", SOON_S)
    processes.send(GuardRequest(1, Event.SWITCH_OFF))
    wait_until(lambda: flight._state.is_waiting, "the machine that waits", SOON_S)


def test_the_rests_of_a_person_count_on_after_a_resume_and_a_switch_off_but_not_for_another(
    processes: Processes, tmp_path: Path
):
    machine, before = Machine(codes=("P-07",)), RestsSoFar(rests=1, left_out=0, motion_s=10.0)
    options = SteeredOptions(participant="P-07", rests=before)
    made = LiveFlight(options, tmp_path, lambda _side: machine)  # type: ignore[arg-type,return-value]
    wait_until(lambda: made._state.is_waiting, "the machine that waits", SOON_S)
    for _ in range(2):
        off_and_on(made, processes)
    assert processes.rests_before == [before, RestsSoFar(rests=2, left_out=1, motion_s=10.0)]
    who = made._state.who
    made.don(DonRequest(id="don-000001", made_at_s=made.now(), seen_version=0, participant=None))
    wait_until(lambda: made._state.is_waiting and made._state.who is not who, "the next person", SOON_S)
    off_and_on(made, processes)
    assert processes.rests_before[-1] == RestsSoFar()
    made.close()


def test_an_arm_that_is_identified_anew_contains_no_motion_of_earlier_rests(processes: Processes, tmp_path: Path):
    options = SteeredOptions(participant="P-07", rests=RestsSoFar(rests=2, left_out=1, motion_s=10.0))
    made = LiveFlight(options, tmp_path, lambda _side: Machine())  # type: ignore[arg-type,return-value]
    wait_until(lambda: made._state.is_waiting, "the machine that waits", SOON_S)
    off_and_on(made, processes)
    assert processes.rests_before == [RestsSoFar(rests=2, left_out=1, motion_s=0.0)]
    made.close()


def test_motors_go_off_again_if_nobody_steers_when_they_went_on(flight: LiveFlight, processes: Processes):
    processes.obeys = False
    flight.ask(Event.TEST)
    wait_until(lambda: processes.is_on, "the motors", SOON_S)
    wait_until(lambda: flight._state.is_waiting, "the machine that waits", SOON_S)
    assert not processes.is_on


def test_a_start_that_is_late_is_said_to_be_late_and_not_that_stop_was_pressed(
    flight: LiveFlight, processes: Processes, monkeypatch: pytest.MonkeyPatch
):
    latches = list[str | None]()
    stop = processes.stop

    def stop_and_look() -> None:
        stop()
        latches.append(flight.moment().latch)

    monkeypatch.setattr(processes, "stop", stop_and_look)
    processes.obeys = False
    flight.ask(Event.TEST)
    wait_until(lambda: processes.is_on, "the motors", SOON_S)
    wait_until(lambda: flight._state.is_waiting, "the machine that waits", SOON_S)
    assert latches == [None]
    (warning,) = flight.moment().warnings
    assert "did not switch on within 2 s" in warning


def test_a_fault_ends_the_session_with_its_sentence(flight: LiveFlight, processes: Processes, machine: Machine):
    machine.cause = "A drive reports a fault. The machine is locked."
    flight.ask(Event.TEST)
    wait_until(lambda: processes.mode is Mode.EXO_ONLY, "the first step", SOON_S)
    processes.stop()
    wait_until(lambda: flight._state.failure, "the failure", SOON_S)
    assert flight._state.failure == machine.cause
    assert not flight._state.is_waiting


def test_closing_a_machine_that_waits_releases_it(flight: LiveFlight, machine: Machine, processes: Processes):
    flight.close()
    assert machine.is_closed
    assert processes.runs == 0


@pytest.mark.parametrize(("refuted", "participant", "motion_s"), [((), "P-07", FROM_FILE_S), (("P-07",), None, 60.0)])
def test_an_arm_whose_stored_estimate_disagreed_is_identified_again_and_the_operator_is_told(
    processes: Processes,
    tmp_path: Path,
    refuted: tuple[str, ...],
    participant: str | None,
    motion_s: float,
):
    machine = Machine(codes=("P-07",), refuted=refuted)
    made = LiveFlight(SteeredOptions(participant="P-07"), tmp_path, lambda _side: machine)  # type: ignore[arg-type,return-value]
    wait_until(lambda: made._state.is_waiting, "the machine that waits", SOON_S)
    assert (made._state.who.participant, made._state.who.identify_s) == (participant, motion_s)
    made.ask(Event.TEST)
    wait_until(lambda: made._state.has_begun, "the parent's look", SOON_S)
    told = [str(text) for text in made._state.warnings]
    assert any("disagreed with its check" in text for text in told) == bool(refuted)
    made.close()
