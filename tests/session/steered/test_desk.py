"""No history of acts carries an arm that nobody made ready and took; what is repeated, late or stale does nothing."""

import itertools
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from exograv.runtime.steering import LEASE_MAX_NS
from exograv.safety.modes import RAMP_IN_S, RAMP_OUT_S, WORN, Mode
from exograv.session.steered.contract import ACT, LATE_S, LEASE_S, READY_S, Act, Answer, Desk
from exograv.session.steered.desk import SteeredDesk
from exograv.session.steered.rehearsed import DESCENT_S, RehearsedFlight

KNOWN = "P-07"
SEEN = ("don", "make_ready", "take_arm", "identify", "reset")
PLAIN = ("give_back", "switch_off")


class Hand:
    """An operator with a clock of one's own."""

    def __init__(self):
        self.t, self._numbers = 1000.0, itertools.count()
        self.flight = RehearsedFlight(lambda: self.t, (KNOWN,))
        self.desk = SteeredDesk(self.flight)
        self.desk.keep()

    def made(self, kind: str, **fields: Any) -> Act:
        if kind in SEEN:
            fields.setdefault("seen_version", self.desk.shown().version)
        return ACT.validate_python({"kind": kind, "id": f"act-{next(self._numbers):06d}", "made_at_s": self.t} | fields)

    def act(self, kind: str, **fields: Any) -> Answer:
        return self.desk.act(self.made(kind, **fields), "operator")

    def wait(self, seconds: float, keeps: bool = True) -> None:
        for _ in range(round(seconds / 0.2)):
            self.t += 0.2
            if keeps:
                self.desk.keep()
            self.desk.shown()

    @property
    def mode(self) -> Mode | None:
        return self.flight.moment().mode

    def float(self) -> None:
        assert self.act("don", participant=KNOWN).taken
        assert self.act("make_ready").taken
        self.wait(0.4)
        assert self.act("take_arm").taken
        self.wait(RAMP_IN_S + 0.4)
        assert self.mode is Mode.FLOATING


@pytest.fixture
def hand() -> Hand:
    return Hand()


def test_it_is_a_desk(hand: Hand):
    assert isinstance(hand.desk, Desk)


def test_an_arm_is_taken_in_two_steps_and_given_back(hand: Hand):
    hand.float()
    assert hand.act("give_back").taken
    hand.wait(RAMP_OUT_S + 0.4)
    assert hand.mode is Mode.EXO_ONLY
    assert not hand.act("take_arm").taken
    assert hand.act("make_ready").taken
    assert hand.act("take_arm").taken


def test_step_one_is_over_after_half_a_minute(hand: Hand):
    hand.act("don", participant=KNOWN)
    hand.act("make_ready")
    hand.wait(READY_S + 0.4)
    assert not hand.act("take_arm").taken
    assert hand.mode is Mode.EXO_ONLY


def test_the_same_act_twice_is_done_once_and_answered_twice(hand: Hand):
    hand.act("don", participant=KNOWN)
    first = hand.made("make_ready")
    answers = [hand.desk.act(first, "operator") for _ in range(3)]
    assert answers == [answers[0]] * 3
    assert answers[0].taken
    acts = [m for topic, _, m in hand.flight.written if topic == "/act" and m["kind"] == "make_ready"]
    assert len(acts) == 1


def test_a_stop_that_comes_late_again_or_from_anybody_lets_the_arm_down_each_time(hand: Hand):
    hand.float()
    stop = hand.made("stop")
    hand.wait(10.0)
    assert hand.desk.act(stop, "viewer").taken
    assert hand.mode is Mode.SAFE
    hand.wait(DESCENT_S + 0.4)
    assert hand.act("reset").taken
    assert hand.act("make_ready").taken
    hand.wait(0.4)
    assert hand.act("take_arm").taken
    assert hand.desk.act(stop, "participant").taken
    assert hand.mode is Mode.SAFE


def test_a_reset_starts_nothing(hand: Hand):
    hand.float()
    hand.act("stop")
    assert not hand.act("reset").taken
    hand.wait(DESCENT_S + 0.4)
    assert hand.act("reset").taken
    hand.wait(60.0)
    assert hand.mode is Mode.OFF


def test_where_nobody_steers_any_more_there_is_an_alarm_and_the_arm_is_given_back(hand: Hand):
    hand.float()
    hand.wait(LEASE_S + 0.4, keeps=False)
    assert hand.mode is Mode.RAMP_OUT
    (alarm,) = hand.desk.shown().alarms
    assert "Nobody steers" in alarm.text
    hand.wait(RAMP_OUT_S + 0.4, keeps=False)
    assert hand.mode is Mode.EXO_ONLY
    hand.desk.keep()
    assert hand.desk.shown().alarms[0].is_over
    assert hand.act("acknowledge", alarm=alarm.number).taken
    assert hand.desk.shown().alarms == ()


def test_a_window_that_runs_is_finished_without_an_operator_and_no_longer(hand: Hand):
    hand.float()
    hand.desk.keep(window_left_s=10.0)
    hand.wait(9.0, keeps=False)
    assert hand.mode is Mode.FLOATING
    hand.wait(1.6, keeps=False)
    assert hand.mode is Mode.RAMP_OUT


def test_pages_are_told_what_is_possible_and_it_is_what_is_not_refused(hand: Hand):
    hand.act("don", participant=KNOWN)
    for kind in ("make_ready", "take_arm", "give_back"):
        assert kind in hand.desk.shown().possible
        assert hand.act(kind, **({"gravity_level": 0.5} if kind == "set_level" else {})).taken
        hand.wait(0.4)


class Histories(RuleBasedStateMachine):
    """Any acts, made now or before, seen or not, kept or lost; what may carry an arm is written once more here."""

    def __init__(self):
        super().__init__()
        self.hand, self.past = Hand(), []
        self.ready_until = -1.0
        self.is_taken = False
        self.silent_s = 0.0

    @rule(kind=st.sampled_from(SEEN + PLAIN), is_stale=st.booleans())
    def ask(self, kind: str, is_stale: bool):
        fields: dict[str, Any] = {"participant": KNOWN} if kind == "don" else {}
        if is_stale and kind in SEEN:
            fields["seen_version"] = self.hand.desk.shown().version - 1
        made = self.hand.made(kind, **fields)
        answer = self.hand.desk.act(made, "operator")
        self.past.append((made, answer))
        if answer.taken:
            assert not (is_stale and kind in SEEN)
            assert self.silent_s <= LEASE_S
            self._note(kind)

    def _note(self, kind: str) -> None:
        if kind == "make_ready":
            self.ready_until = self.hand.t + READY_S
        elif kind in ("take_arm", "identify"):
            assert self.hand.t <= self.ready_until
            self.ready_until, self.is_taken = -1.0, True
        elif kind in ("give_back", "switch_off", "reset", "don"):
            self.ready_until = -1.0

    @rule(by=st.sampled_from(["operator", "participant", "viewer"]))
    def stop(self, by):
        assert self.hand.desk.act(self.hand.made("stop"), by).taken
        self.ready_until, self.is_taken = -1.0, False
        assert self.hand.flight.moment().arm_share == 0.0

    @precondition(lambda self: self.past)
    @rule(data=st.data())
    def repeat(self, data: st.DataObject):
        made, answer = data.draw(st.sampled_from(self.past))
        before = self.hand.mode
        assert self.hand.desk.act(made, "operator") == answer
        assert self.hand.mode is before

    @precondition(lambda self: self.past)
    @rule(data=st.data())
    def replay_under_another_name(self, data: st.DataObject):
        made, _ = data.draw(st.sampled_from(self.past))
        if self.hand.t - made.made_at_s > LATE_S:
            again = made.model_copy(update={"id": f"again-{next(self.hand._numbers):06d}"})
            assert not self.hand.desk.act(again, "operator").taken

    @rule(seconds=st.sampled_from([0.2, 1.0, 4.0, 31.0]), keeps=st.booleans())
    def wait(self, seconds: float, keeps: bool):
        for _ in range(round(seconds / 0.2)):
            self.hand.wait(0.2, keeps)
            self.silent_s = 0.0 if keeps else self.silent_s + 0.2
            if self.silent_s > LEASE_S:
                self.ready_until = -1.0
        if self.silent_s > LEASE_S + RAMP_OUT_S + 0.4:
            assert self.hand.mode not in WORN
        if self.hand.mode not in WORN and self.hand.mode is not Mode.EXO_ONLY:
            self.is_taken = False

    @invariant()
    def nothing_is_carried_that_nobody_took(self):
        moment = self.hand.flight.moment()
        if moment.mode in WORN or moment.arm_share > 0.0:
            assert self.is_taken


Histories.TestCase.settings = settings(max_examples=25, stateful_step_count=25, deadline=None)
TestHistories = Histories.TestCase


def test_the_guard_and_the_desk_mean_the_same_lease():
    assert round(1e9 * LEASE_S) == LEASE_MAX_NS
