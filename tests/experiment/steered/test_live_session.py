"""Real processes obey an operator: they start and stop from a desk, and give the arm back without an operator."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.console.nominal_console import nominal_knowledge
from tests.waiting import wait_until

from exograv.cli.recordings.replaying import run_replay
from exograv.experiment.steered import live_session
from exograv.experiment.steered.live_session import LiveFlight
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.prepared_machine import PreparedMachine
from exograv.experiment.steered.requests import ACT, Answer
from exograv.experiment.steered.session_controller import SessionController
from exograv.experiment.steered.view_models import RestLearning
from exograv.laboratory.preparation import Preparation
from exograv.loop.replay.what_if import ReplayOverrides
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.recording import read_recording
from exograv.results import json_value
from exograv.runtime.control_loop.exchange import STOP_PRESSED
from exograv.storage.participant_file import read_participant

pytestmark = pytest.mark.slow

SOON_S = 120.0
"""Time-out for the start of processes on a busy computer."""

KEEP_S = 0.1
KEPT_WITHIN_S = 5.0
STOP_WITHIN_S = 0.5
"""Time-out: ten times the promise for an idle computer (docs/howto/steering.md).

    The test shows that Stop works, not its delay.
"""


class Operator:
    def __init__(self, desk: SessionController):
        self.desk, self._number = desk, 0

    def act(self, kind: str, **fields) -> Answer:
        self._number += 1
        if kind in ("make_ready", "take_arm", "identify", "reset", "don", "learn_rest"):
            fields.setdefault("seen_version", self.desk.shown().version)
        made = {"kind": kind, "id": f"act-{self._number:06d}", "made_at_s": self.desk.now(), **fields}
        return self.desk.act(ACT.validate_python(made), "operator")

    def until(self, mode: str, keeps: bool = True) -> None:
        def is_in_mode() -> bool:
            if keeps:
                self.desk.keep()
            return self.desk.shown().mode == mode

        wait_until(is_in_mode, lambda: self.desk.shown().mode_text, SOON_S, KEEP_S)

    def float_identified(self) -> None:
        """Make the machine ready, identify the arm, and wait until it floats."""
        self.until("off")
        self.act("make_ready")
        self.until("exo_only")
        assert self.act("identify").taken
        self.until("moving")
        self.until("floating")

    def rests(self) -> RestLearning:
        rests = self.desk.shown().rests
        assert rests is not None
        return rests

    def begin_rest(self) -> None:
        """Begin to learn in a rest as soon as that is prepared."""

        def begins() -> bool:
            self.desk.keep()
            return self.act("learn_rest").taken

        wait_until(begins, lambda: self.rests().why_not, SOON_S, KEEP_S)

    def until_rest_is_over(self) -> None:
        def is_over() -> bool:
            self.desk.keep()
            return not self.rests().is_active

        wait_until(is_over, lambda: self.desk.shown().work, SOON_S, KEEP_S)

    def kept(self) -> str:
        """Wait until the estimate is stored, and return the participant's code."""

        def code() -> str | None:
            self.desk.keep()
            return self.desk.shown().participant

        return wait_until(code, lambda: self.desk.shown().learning, KEPT_WITHIN_S, KEEP_S) or ""

    def reset(self) -> None:
        def is_reset() -> bool:
            self.desk.keep()
            return self.act("reset").taken

        wait_until(is_reset, "a reset", SOON_S, KEEP_S)


@pytest.fixture
def operator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Operator]:
    """Desk of a machine that agrees with its files. The tests are about permissions and order."""
    monkeypatch.setattr(Preparation, "calibrated", nominal_knowledge)
    options = SteeredOptions(level=1, seed=1001, identify_s=10.0, session_s=600.0, participants=tmp_path / "people")
    desk = SessionController(LiveFlight(options, tmp_path, lambda side: PreparedMachine(options, side)))
    yield Operator(desk)
    desk.close()


def test_it_begins_and_stops_at_an_operators_word_and_is_replayed_to_the_last_bit(operator: Operator, tmp_path: Path):
    operator.until("off")
    assert not operator.act("take_arm").taken
    assert operator.act("make_ready").taken
    operator.until("exo_only")
    assert not operator.act("take_arm").taken  # No arm is known.
    assert operator.act("identify").taken
    operator.until("ramp_in")
    pressed = time.monotonic()
    assert operator.act("stop").taken
    operator.until("safe")
    assert operator.desk.shown().latch == "Stop was pressed."
    operator.reset()
    operator.until("off")
    shown, trace = operator.desk.shown(), operator.desk.trace(0)
    assert shown.lateness is not None
    assert len(trace.q_rad) == trace.next - trace.first > 10
    assert len(operator.desk.skeleton().arm[0]) > 2
    operator.desk.close()
    path = tmp_path / "steered-1.mcap"
    recording = read_recording(path)
    heard = recording.ticks[(recording.ticks["acts"] & STOP_PRESSED) > 0]["monotonic"]
    assert 0.0 < heard[0] - pressed < STOP_WITHIN_S
    acts = [page["message"] for page in recording.messages("/page")]
    assert [(act["kind"], act["by"], act["taken"]) for act in acts[:4]] == [
        ("take_arm", "operator", False),
        ("make_ready", "operator", True),
        ("take_arm", "operator", False),
        ("identify", "operator", True),
    ]
    found = json_value(run_replay(path, None, lambda *_: None, ReplayOverrides()))
    assert found["bit_identical"] == {"tau_desired": True, "tau_commanded": True}


def test_a_level_that_the_guard_takes_after_the_time_out_is_shown_as_the_requested_one(
    operator: Operator, monkeypatch: pytest.MonkeyPatch
):
    operator.float_identified()
    monkeypatch.setattr(live_session, "ANSWER_WITHIN_S", 0.0)
    assert "did not answer in time" in operator.act("set_level", gravity_level=0.3).why

    def is_shown() -> bool:
        operator.desk.keep()
        return operator.desk.shown().gravity_level_asked == 0.3

    wait_until(is_shown, "the requested level", SOON_S, KEEP_S)


def test_an_arm_that_nobody_steers_any_more_is_given_back(operator: Operator):
    operator.until("off")
    operator.act("make_ready")
    operator.until("exo_only")
    assert operator.act("identify").taken
    operator.until("ramp_in")
    operator.until("ramp_out", keeps=False)
    operator.until("exo_only", keeps=False)
    shown = operator.desk.shown()
    assert "No operator steers" in shown.alarms[-1].text
    assert np.all(np.array(shown.tau_limit_Nm) > 0.0)
    assert shown.latch is None


def test_who_was_learned_is_kept_and_only_checked_the_next_time(operator: Operator, tmp_path: Path):
    operator.until("off")
    operator.act("make_ready")
    operator.until("exo_only")
    assert operator.act("identify").taken
    operator.until("moving")
    operator.until("floating")
    code = operator.kept()
    path = tmp_path / "people" / f"{code}.toml"
    first = read_participant(path)
    assert (first.person.code, first.identified.donnings) == (code, 1)
    operator.act("give_back")
    operator.until("exo_only")
    operator.act("switch_off")
    operator.until("off")
    assert operator.act("don", participant=code).taken
    operator.until("starting")
    operator.until("off")
    shown = operator.desk.shown()
    assert (shown.participant, shown.is_known) == (code, True)
    operator.act("make_ready")
    operator.until("exo_only")
    assert operator.act("take_arm").taken
    operator.until("moving")
    begun = operator.desk.now()
    operator.until("floating")
    assert FROM_FILE_S <= operator.desk.now() - begun < 2.0 * FROM_FILE_S

    def is_stored() -> bool:
        operator.desk.keep()
        return read_participant(path).identified.donnings > 1

    wait_until(is_stored, "the participant's file", KEPT_WITHIN_S, KEEP_S)
    again = read_participant(path)
    assert (again.identified.donnings, again.identified.motion_s) == (2, pytest.approx(FROM_FILE_S, abs=0.5))
    learning = operator.desk.shown().learning
    assert learning is not None
    assert [row.prior for row in learning.parameters] != [row.mean for row in learning.parameters]


def test_another_side_is_another_machine_with_its_own_recording(operator: Operator, tmp_path: Path):
    operator.until("off")
    assert operator.desk.shown().sides == ("right", "left")
    assert operator.act("don", side="left").taken
    operator.until("starting")
    operator.until("off")
    assert operator.desk.shown().side == "left"
    operator.desk.close()
    sides = [read_recording(tmp_path / f"steered-{number}.mcap").settings["side"] for number in (1, 2)]
    assert sides == ["right", "left"]
