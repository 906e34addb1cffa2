"""No sequence of acts carries an arm without both steps. Repeated, late and stale acts have no effect."""

import itertools
from random import Random
from typing import Any

import pytest

from exograv.experiment.steered.rehearsal import CALIBRATED_S, DESCENT_S, WRITTEN_MAX, RehearsedFlight
from exograv.experiment.steered.requests import ACT, LATE_S, LEASE_S, READY_S, Act, Answer, Desk
from exograv.experiment.steered.session_controller import SessionController
from exograv.runtime.control_loop.steering import LEASE_MAX_NS
from exograv.safety.modes import RAMP_IN_S, RAMP_OUT_S, WORN, Mode

KNOWN = "P-07"
SEEN = ("don", "make_ready", "take_arm", "identify", "reset")
PLAIN = ("give_back", "switch_off")


class Hand:
    """Operator with a clock of the test."""

    def __init__(self):
        self.t, self._numbers = 1000.0, itertools.count()
        self.flight = RehearsedFlight(lambda: self.t, (KNOWN,))
        self.desk = SessionController(self.flight)
        self.desk.keep()

    def made(self, kind: str, **fields: Any) -> Act:
        if kind in SEEN:
            fields.setdefault("seen_version", self.desk.shown().version)
        return ACT.validate_python({"kind": kind, "id": f"act-{next(self._numbers):06d}", "made_at_s": self.t} | fields)

    def act(self, kind: str, **fields: Any) -> Answer:
        return self.desk.act(self.made(kind, **fields), "operator")

    def wait(self, seconds: float, keeps: bool = True, step_s: float = 0.2) -> None:
        for _ in range(round(seconds / step_s)):
            self.t += step_s
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


def test_after_stop_it_is_said_what_it_was_and_not_that_a_fault_was_found(hand: Hand):
    hand.float()
    hand.act("stop")
    said = hand.desk.shown().mode_text
    assert said.startswith("Stop was pressed. The arm was let down softly.")
    assert "fault" not in said


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
    assert "No operator steers" in alarm.text
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


def test_the_side_is_chosen_while_the_machine_is_off_and_never_while_it_holds_an_arm(hand: Hand):
    assert hand.desk.shown().sides == ("right", "left")
    seen = hand.desk.shown().version
    assert hand.act("don", side="left").taken
    assert (hand.desk.shown().side, hand.desk.shown().version > seen) == ("left", True)
    hand.wait(CALIBRATED_S + 0.4)  # another side is another machine, which is calibrated first
    refused = hand.act("don", side="both")
    assert "right, left" in refused.why
    hand.float()
    assert hand.desk.shown().side == "left"
    for mode in ("floating", "ramp_out"):
        assert hand.desk.shown().mode == mode
        assert not hand.act("don", side="right").taken
        hand.act("give_back")
        hand.wait(0.4)
    assert hand.desk.shown().side == "left"


def test_a_rehearsal_keeps_the_newest_of_what_it_would_have_recorded(hand: Hand):
    for number in range(WRITTEN_MAX + 5):
        hand.desk.write("/task", hand.t, {"number": number})
    assert len(hand.flight.written) == WRITTEN_MAX
    assert hand.flight.written[-1][2]["number"] == WRITTEN_MAX + 4


class History:
    """Random acts, new or old, with a fresh or stale state, stored or lost.

    The rules for a carried arm are written here a second time.
    """

    def __init__(self, seed: int):
        self.chance, self.hand, self.past = Random(seed), Hand(), list[tuple[Act, Answer]]()
        assert self.hand.act("don", participant=KNOWN).taken
        self.ready_until, self.is_taken, self.silent_s, self.takes = -1.0, False, 0.0, 0

    def go_on(self) -> None:
        """Do one random step."""
        way = self.chance.choices(
            (self.ask, self.press_on, self.stop, self.repeat, self.replay_under_another_name, self.wait),
            weights=(3, 6, 1, 1, 1, 5),
        )
        way[0]()
        moment = self.hand.flight.moment()
        if moment.mode in WORN or moment.arm_share > 0.0:
            assert self.is_taken

    def ask(self) -> None:
        kind, is_stale = self.chance.choice(SEEN + PLAIN), self.chance.random() < 0.3
        fields: dict[str, Any] = {"participant": KNOWN} if kind == "don" else {}
        if is_stale and kind in SEEN:
            fields["seen_version"] = self.hand.desk.shown().version - 1
        answer = self._asked(self.hand.made(kind, **fields))
        assert not (answer.taken and is_stale and kind in SEEN)

    def press_on(self) -> None:
        """Return the act that an operator would request next, so that histories reach all modes."""
        self.hand.desk.keep()
        self.silent_s = 0.0
        nexts = {Mode.OFF: "make_ready", Mode.EXO_ONLY: "take_arm", Mode.FLOATING: "give_back", Mode.SAFE: "reset"}
        if (mode := self.hand.mode) in nexts:
            self._asked(self.hand.made(nexts[mode]))

    def stop(self) -> None:
        by = self.chance.choice(["operator", "participant", "viewer"])
        assert self.hand.desk.act(self.hand.made("stop"), by).taken  # pyright: ignore[reportArgumentType]
        self.ready_until, self.is_taken = -1.0, False

    def repeat(self) -> None:
        if self.past:
            made, answer = self.chance.choice(self.past)
            before = self.hand.mode
            assert self.hand.desk.act(made, "operator") == answer
            assert self.hand.mode is before

    def replay_under_another_name(self) -> None:
        late = [made for made, _ in self.past if self.hand.t - made.made_at_s > LATE_S]
        if late:
            again = self.chance.choice(late).model_copy(update={"id": self.hand.made("give_back").id})
            assert not self.hand.desk.act(again, "operator").taken

    def wait(self) -> None:
        keeps = self.chance.random() < 0.8
        for _ in range(self.chance.choice([1, 1, 4, 6, 31])):
            self.hand.wait(1.0, keeps, step_s=1.0)
            self.silent_s = 0.0 if keeps else self.silent_s + 1.0
            if self.silent_s > LEASE_S:
                self.ready_until = -1.0
        if self.silent_s > LEASE_S + RAMP_OUT_S + 0.4:
            assert self.hand.mode not in WORN
        if self.hand.mode not in WORN:
            self.is_taken = False

    def _asked(self, made: Act) -> Answer:
        answer = self.hand.desk.act(made, "operator")
        self.past.append((made, answer))
        if not answer.taken:
            return answer
        assert self.silent_s <= LEASE_S
        if made.kind == "make_ready":
            self.ready_until = self.hand.t + READY_S
        elif made.kind in ("take_arm", "identify"):
            assert self.hand.t <= self.ready_until
            self.ready_until, self.is_taken, self.takes = -1.0, True, self.takes + 1
        else:
            self.ready_until = -1.0
        return answer


def test_in_no_history_is_an_arm_carried_that_nobody_made_ready_and_took():
    takes = 0
    for seed in range(15):
        history = History(seed)
        for _ in range(60):
            history.go_on()
        takes += history.takes
    assert takes > 15  # Fewer would prove nothing.


def test_the_guard_and_the_desk_mean_the_same_lease():
    assert round(1e9 * LEASE_S) == LEASE_MAX_NS


def test_a_level_is_recorded_as_the_support_that_the_pages_show(hand: Hand):
    hand.float()
    assert hand.act("set_level", gravity_level=0.2).taken
    acts = [message for topic, _, message in hand.flight.written if topic == "/act"]
    (said,) = [act for act in acts if act["kind"] == "set_level"]
    assert (said["gravity_level"], said["support"]) == (0.2, "support 80 % (felt weight 20 %)")
