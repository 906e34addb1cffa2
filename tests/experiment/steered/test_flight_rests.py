"""Learning in a rest ends with a floating arm, or in a descent; whatever happens, an arm that is taken again floats."""

import json
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
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
from exograv.storage.participant_file import read_participant
from exograv.storage.participant_schema import StoredParticipant
from exograv.storage.rests_so_far import NO_RESTS, RestsSoFar

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
    return flight_of(ReadyMachine.made(tmp_path, RIG))


def flight_of(made: ReadyMachine, before: RestsSoFar = NO_RESTS) -> LiveFlight:
    """Return the flight of a session; one that is resumed has the rests from before."""
    tmp_path = made.folder
    options = SteeredOptions(
        rig=RIG, drives=tmp_path / "udp.toml", simulate=True, level=LEVEL, seed=SEED, identify_s=10.0, session_s=600.0,
        participants=tmp_path / "people", participant="P-07", rests=before,
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


def replays_exactly(folder: Path, number: int = 1) -> bool:
    path = folder / "out" / f"steered-{number}.mcap"
    found = json_value(run_replay(path, None, lambda *_: None, ReplayOverrides()))
    return all(found["bit_identical"].values())


def stored(folder: Path) -> StoredParticipant:
    """Return the participant's file."""
    return read_participant(folder / "people" / "P-07.toml")


def until_phase(operator: Operator, code: str) -> None:
    def is_there() -> bool:
        operator.desk.keep()
        work = operator.desk.shown().work
        return work is not None and isinstance(work.phase, Sentence) and work.phase.code == code

    wait_until(is_there, lambda: operator.desk.shown().work, SOON_S, KEEP_S)


def take_again(operator: Operator) -> None:
    """Take an arm that was given back, and wait until it floats."""
    refusals = list[str]()

    def takes() -> bool:
        operator.desk.keep()
        if operator.desk.shown().take_within_s is None:
            operator.act("make_ready")
        refusals.append(operator.act("take_arm").why)
        return not refusals[-1]

    wait_until(takes, lambda: refusals[-1], SOON_S, KEEP_S)
    operator.until("floating")


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
    take_again(operator)
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


def test_the_file_gets_the_arm_of_a_rest_that_floats_and_none_of_a_rest_that_ended_after_its_motion(
    operator: Operator, flight: LiveFlight, tmp_path: Path
):
    operator.kept()
    identified = stored(tmp_path)
    assert identified.identified.motion == "designed"
    operator.begin_rest()
    until_phase(operator, "rest.phase_back")
    assert operator.act("give_back").taken
    operator.until("exo_only")
    operator.until_rest_is_over()
    assert operator.rests().rests == 1
    take_again(operator)
    operator.begin_rest()
    assert stored(tmp_path) == identified
    operator.until_rest_is_over()
    rests, state = operator.rests(), flight._state.rests
    assert state is not None
    checked, after = state._rests.checked, stored(tmp_path)
    told = [code(sentence) for sentence in rests.sentences]
    assert rests.motion_s > 1.8 * REST_MOTION_S, "the estimate uses the motion of both rests"
    assert rests.rests == 2
    assert checked is not None
    assert told[-1] == "rest.stored"
    assert after.mean.tolist() == pytest.approx(checked.x[: len(after.mean)], rel=1e-6)
    assert (after.identified.motion, after.identified.donnings) == ("rests", identified.identified.donnings)
    assert after.identified.motion_s == pytest.approx(rests.motion_s, abs=0.01)


def longest_path(folder: Path, number: int) -> object:
    """Return the motion that taught in the first rest of a recording, as it was ordered."""
    control = read_recording(folder / "out" / f"steered-{number}.mcap").messages("/control")
    paths = [message["path"] for message in control if message["act"] == "order" and message["path"] is not None]
    return max(paths[:3], key=lambda path: len(json.dumps(path)))


def test_a_resumed_session_goes_on_from_the_arm_that_the_rests_have_shown_and_both_parts_replay(tmp_path: Path):
    made = ReadyMachine.made(tmp_path, RIG)
    first = Operator(SessionController(flight_of(made)))
    first.float_identified()
    first.begin_rest()
    first.until_rest_is_over()
    shown = first.rests()
    so_far = RestsSoFar(shown.rests, shown.left_out, shown.motion_s)
    first.desk.close()
    before = stored(tmp_path)
    assert before.identified.motion == "rests"
    second = Operator(SessionController(flight_of(made, so_far)))
    second.until("off")
    assert second.desk.shown().is_known
    second.act("make_ready")
    second.until("exo_only")
    assert second.act("take_arm").taken
    second.until("moving")
    second.until("floating")
    second.begin_rest()
    again = second.rests()
    assert (again.rests, again.motion_s) == (so_far.rests, so_far.motion_s)
    assert np.mean(again.before_Nm) < np.mean(shown.before_Nm)
    second.until_rest_is_over()
    assert second.rests().rests == so_far.rests + 1
    assert second.rests().motion_s > so_far.motion_s + 0.9 * REST_MOTION_S
    second.desk.close()
    assert stored(tmp_path).identified.donnings == before.identified.donnings + 1
    assert longest_path(tmp_path, 2) != longest_path(tmp_path, 1), "the same motion again would teach little"
    assert replays_exactly(tmp_path, 1)
    assert replays_exactly(tmp_path, 2)
