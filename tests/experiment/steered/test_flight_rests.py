"""Learning in a rest ends with a floating arm, or in a descent; whatever happens, an arm that is taken again floats."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.experiment.steered.test_live_session import KEEP_S, SOON_S, Operator
from tests.live.on_drives.ready_machine import LEVEL, SEED, ReadyMachine
from tests.waiting import wait_until

from exograv.api.rig_factory import steered_flight
from exograv.cli.recordings.replaying import run_replay
from exograv.experiment.steered.live_session import LiveFlight
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.session_controller import SessionController
from exograv.live.options import PersonForm
from exograv.loop.replay.what_if import ReplayOverrides
from exograv.procedures.identification.rest_learning import REST_MOTION_S
from exograv.recording import read_recording
from exograv.results import json_value
from exograv.sentence import Sentence

pytestmark = pytest.mark.slow

RIG = "recupera_like_qdd"
EARTH = 1.0


def code(text: str) -> str:
    """Return the code of a sentence."""
    assert isinstance(text, Sentence)
    return text.code


@pytest.fixture
def flight(tmp_path: Path) -> LiveFlight:
    """Flight on simulated drives that wait for this computer."""
    made = ReadyMachine.made(tmp_path, RIG)
    options = SteeredOptions(
        rig=RIG, drives=tmp_path / "udp.toml", simulate=True, level=LEVEL, seed=SEED, identify_s=10.0, session_s=600.0
    )  # fmt: skip
    flight = steered_flight(options, PersonForm(), made.folder / "out", "run console", lambda _: None)
    assert isinstance(flight, LiveFlight)
    return flight


@pytest.fixture
def operator(flight: LiveFlight) -> Iterator[Operator]:
    made = Operator(SessionController(flight))
    made.float_identified()
    yield made
    made.desk.close()


def feel(operator: Operator, gravity_level: float) -> None:
    def asks() -> bool:
        operator.desk.keep()
        return operator.act("set_level", gravity_level=gravity_level).taken

    def is_felt() -> bool:
        operator.desk.keep()
        return operator.desk.shown().gravity_level == gravity_level

    wait_until(asks, "a level", SOON_S, KEEP_S)
    wait_until(is_felt, lambda: operator.desk.shown().gravity_level, SOON_S, KEEP_S)


def replays_exactly(folder: Path) -> bool:
    found = json_value(run_replay(folder / "out" / "steered-1.mcap", None, lambda *_: None, ReplayOverrides()))
    return all(found["bit_identical"].values())


def until_it_moves(operator: Operator) -> None:
    operator.begin_rest()
    operator.until("moving")


def test_a_rest_moves_and_learns_the_floating_arm_and_gives_back_the_weight_that_the_person_felt(
    operator: Operator, tmp_path: Path
):
    feel(operator, EARTH)
    operator.begin_rest()
    assert not operator.act("learn_rest").taken
    assert not operator.act("set_level", gravity_level=0.5).taken
    operator.until("moving")
    shown = operator.desk.shown()
    assert shown.gravity_level == 0.0
    assert shown.work is not None
    assert shown.work.kind == "rest"
    operator.until_rest_is_over()
    rests = operator.rests()
    assert rests.rests == 1
    assert rests.motion_s > 0.9 * REST_MOTION_S

    def is_back() -> bool:
        operator.desk.keep()
        return operator.desk.shown().gravity_level == EARTH

    wait_until(is_back, lambda: operator.desk.shown().gravity_level, SOON_S, KEEP_S)
    assert operator.desk.shown().mode == "floating"
    operator.desk.close()
    control = read_recording(tmp_path / "out" / "steered-1.mcap").messages("/control")
    orders = [message for message in control if message["act"] == "order"]
    assert sum(order["x"] is not None for order in orders) == (code(rests.sentences[0]) == "rest.taken")
    assert [order["is_led"] for order in orders] == [*(True for _ in orders[1:]), False]
    assert replays_exactly(tmp_path)


def test_stop_lets_the_arm_down_during_the_motion_of_a_rest_and_the_recording_replays(
    operator: Operator, tmp_path: Path
):
    until_it_moves(operator)
    assert operator.act("stop").taken
    operator.until("safe")
    operator.until_rest_is_over()
    assert operator.rests().rests == 0
    assert "ended early" in operator.rests().sentences[0]
    operator.desk.close()
    assert replays_exactly(tmp_path)


def test_an_arm_that_is_given_back_during_the_motion_floats_still_when_it_is_taken_again(
    operator: Operator, tmp_path: Path
):
    until_it_moves(operator)
    assert operator.act("give_back").taken
    operator.until("exo_only")
    operator.until_rest_is_over()
    assert operator.desk.shown().latch is None
    refusals = list[str]()

    def takes() -> bool:
        operator.desk.keep()
        if operator.desk.shown().take_within_s is None:
            operator.act("make_ready")
        refusals.append(operator.act("take_arm").why)
        return not refusals[-1]

    wait_until(takes, lambda: refusals[-1], SOON_S, KEEP_S)
    operator.until("floating")
    ends = time.monotonic() + 2.0
    while time.monotonic() < ends:
        operator.desk.keep()
        assert operator.desk.shown().mode == "floating"
        time.sleep(KEEP_S)
    operator.begin_rest()
    operator.until_rest_is_over()
    assert operator.rests().rests == 1
    operator.desk.close()
    assert replays_exactly(tmp_path)


def test_without_the_process_that_learns_the_arm_floats_again_and_the_operator_is_told(
    operator: Operator, flight: LiveFlight
):
    until_it_moves(operator)
    rests = flight._state.rests
    assert rests is not None
    process = rests._rests._process
    assert process is not None
    os.kill(process.pid, signal.SIGKILL)
    operator.until_rest_is_over()
    shown = operator.desk.shown()
    assert (shown.mode, shown.latch) == ("floating", None)
    assert code(operator.rests().sentences[0]) == "rest.process_ended"
    assert "cannot learn in rests" in operator.act("learn_rest").why
