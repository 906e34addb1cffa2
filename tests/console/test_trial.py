"""Touches of a page become records, once and at their own time; a machine that releases the arm pauses the run."""

import json
from typing import Any

import pytest

from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.messages import RunCommand
from exograv.console.trial import REST_NEEDED_S, ProtocolTrial
from exograv.experiment.steered.view_models import RestLearning
from exograv.safety.modes import Event

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import answer, do, name, page, pinged, told, touch
from .test_handlers import floating

OPENS_S = 35.0


def trial_of(house: Hub) -> ProtocolTrial:
    assert house.trial is not None
    return house.trial


def word(clock: SetClock, what: str) -> dict[str, object]:
    return {"kind": "run", "id": name(), "made": clock.t - 100.0, "word": what}


def in_window(house: Hub, desk: FakeDesk, clock: SetClock):
    """Advance to two seconds in the first window, with a participant's page."""
    operator = floating(house, desk, clock)
    assert answer(told(house, operator, word(clock, "start")))["taken"]
    clock.t += OPENS_S + 2.0
    trial_of(house).tick(clock.t, desk.shown())
    return page(house, Role.PARTICIPANT, clock)


def sent(*touches: dict[str, object]) -> dict[str, object]:
    return {"kind": "touches", "touches": list(touches)}


def test_a_touch_is_scored_at_the_time_of_the_finger_and_acknowledged(house: Hub, desk: FakeDesk, clock: SetClock):
    line = in_window(house, desk, clock)
    words = told(house, line, sent(touch(clock, 0, line.page, age_s=0.2)))
    assert words == [{"kind": "touched", "page": line.page, "sequence": 0, "accepted": True}]
    (record,) = [message for topic, _, message in desk.written if topic == "/task" and message["kind"] == "touch"]
    assert record["t"] == pytest.approx(clock.t - 0.2, abs=1e-6)
    assert record["deviation_px"] == pytest.approx(5.0)


def test_a_touch_is_kept_raw_with_the_pages_time_ours_and_the_bound_between(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    line = in_window(house, desk, clock)
    told(house, line, sent(touch(clock, 0, line.page, width_px=31.0)))
    (raw,) = [message for topic, _, message in desk.written if topic == "/console/touch"]
    assert raw["at"] == clock.t - 100.0
    assert raw["placed"] == pytest.approx(clock.t, abs=1e-6)
    assert raw["bound_s"] < 1e-3
    assert (raw["origin_ms"], raw["ratio"], raw["width_px"]) == (1.7e12, 2.0, 31.0)
    kept = [json.loads(text) for text in house.diary.path.read_text(encoding="utf-8").splitlines()]
    assert [one["message"] for one in kept if one["topic"] == "/console/touch"] == [raw]


def test_a_queue_that_comes_late_and_twice_is_counted_once(house: Hub, desk: FakeDesk, clock: SetClock):
    line = in_window(house, desk, clock)
    queue = [touch(clock, number, line.page, age_s=-2.5 * number) for number in range(4)]
    clock.t += 12.0
    for _ in range(2):
        told(house, line, sent(*queue))
    assert trial_of(house).operator(clock.t).totals.accepted == 4
    assert trial_of(house).operator(clock.t).totals.rejected == {"repeated": 4}


def test_touches_of_a_page_before_its_reload_keep_their_own_clock(house: Hub, desk: FakeDesk, clock: SetClock):
    line = in_window(house, desk, clock)
    old, moment = line.page, touch(clock, 7, line.page)
    house.close(line)
    clock.t += 3.0
    # The clock of a reloaded page starts again at zero.
    again = page(house, Role.PARTICIPANT)
    told(house, again, {"kind": "ping", "asked": 0.5})
    told(house, again, {"kind": "ping", "asked": 0.5, "previous": {"asked": 0.5, "back": 0.5}})
    told(house, again, sent(moment))
    (record,) = [message for topic, _, message in desk.written if topic == "/task" and message["kind"] == "touch"]
    assert record["page"] == old
    assert record["is_accepted"]
    assert record["t"] == pytest.approx(clock.t - 3.0, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"is_primary": False}, "second"),
        ({"width_px": 400.0}, "palm"),
        ({"height_px": 400.0}, "palm"),
        ({"pointer": "mouse"}, "pointer"),
        ({"x_px": 2500.0}, "off_target"),
    ],
)
def test_palm_second_finger_and_mouse_are_kept_with_their_reason(
    house: Hub, desk: FakeDesk, clock: SetClock, changes: dict[str, Any], reason: str
):
    line = in_window(house, desk, clock)
    (word,) = told(house, line, sent(touch(clock, 0, line.page, **changes)))
    assert word["accepted"] is False
    assert trial_of(house).operator(clock.t).totals.rejected == {reason: 1}


def test_a_page_cannot_forge_when_its_ping_was_heard(house: Hub, desk: FakeDesk, clock: SetClock):
    line = in_window(house, desk, clock)
    before = house.clocks.place(line.page, clock.t - 100.0)
    lie = {"asked": 12345.0, "back": 12345.0}
    told(house, line, {"kind": "ping", "asked": clock.t - 100.0, "previous": lie})
    told(house, line, {"kind": "ping", "asked": clock.t - 99.0, "previous": pinged(clock)})
    after = house.clocks.place(line.page, clock.t - 100.0)
    assert before is not None
    assert after is not None
    assert after.t == pytest.approx(before.t, abs=1e-6)


def test_an_active_protocol_does_not_start_without_an_arm_that_is_carried(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    refused = answer(told(house, line, word(clock, "start")))
    assert not refused["taken"]
    assert "take the arm" in refused["why"]
    assert trial_of(house).run.state.status == "ready"


def test_a_start_that_is_late_starts_nothing(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)
    late = {**word(clock, "start"), "made": clock.t - 101.0}
    assert not answer(told(house, line, late))["taken"]
    assert trial_of(house).run.state.status == "ready"


def test_a_machine_that_lets_go_pauses_the_run_and_breaks_the_window_off(house: Hub, desk: FakeDesk, clock: SetClock):
    in_window(house, desk, clock)
    desk.machine.take(Event.FAULT)
    clock.t += 0.02
    assert "paused" in trial_of(house).tick(clock.t, desk.shown())
    assert trial_of(house).run.state.status == "paused"
    assert trial_of(house).tick(clock.t + 0.02, desk.shown()) == ""


def test_a_window_does_not_end_as_complete_on_a_machine_that_has_fallen_silent(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    in_window(house, desk, clock)
    run = trial_of(house).run
    ends = run.state.windows[-1].opened + run.plan.protocol.windows.duration_s
    trial_of(house).tick(ends - 0.1, desk.shown())
    desk.age_s = 0.5
    assert trial_of(house).tick(ends + 0.3, desk.shown()) == ""
    assert run.state.window is not None
    desk.age_s = 1.1
    assert "paused" in trial_of(house).tick(ends + 0.9, desk.shown())
    (window,) = run.state.windows
    assert (window.is_complete, window.closed_by) == (False, "pause")


def test_a_machine_that_speaks_again_at_once_costs_no_window(house: Hub, desk: FakeDesk, clock: SetClock):
    in_window(house, desk, clock)
    run = trial_of(house).run
    ends = run.state.windows[-1].opened + run.plan.protocol.windows.duration_s
    desk.age_s = 0.5
    trial_of(house).tick(ends + 0.1, desk.shown())
    desk.age_s = 0.0
    trial_of(house).tick(ends + 0.2, desk.shown())
    (window,) = run.state.windows
    assert (window.is_complete, window.closed) == (True, pytest.approx(ends))


def test_the_level_is_asked_for_in_a_run_and_left_to_the_operator_before(house: Hub, desk: FakeDesk, clock: SetClock):
    assert trial_of(house).level(clock.t) is None
    in_window(house, desk, clock)
    assert trial_of(house).level(clock.t) == 0.0


def test_a_screen_is_calibrated_before_a_run_and_not_in_it(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.PARTICIPANT, clock)
    card = {"kind": "calibrate", "card_px": [428.0, 269.9]}
    assert answer(told(house, line, {**card, "id": name()}))["screen"]["pitch_x_mm"] == pytest.approx(0.2)
    refused = answer(told(house, line, {"kind": "calibrate", "id": name(), "card_px": [4280.0, 269.9]}))
    assert not refused["taken"]
    assert "zoomed" in refused["why"]
    in_window(house, desk, clock)
    assert "before a run" in answer(told(house, line, {**card, "id": name()}))["why"]
    assert trial_of(house).plan.screen is not None


def test_a_ruler_calibrates_too_and_nothing_at_all_does_not(house: Hub, clock: SetClock):
    line = page(house, Role.PARTICIPANT, clock)
    span = {"dx_px": 500.0, "dy_px": 0.0, "distance_mm": 100.0}
    assert answer(told(house, line, {"kind": "calibrate", "id": name(), "spans": [span]}))["taken"]
    assert not answer(told(house, line, {"kind": "calibrate", "id": name()}))["taken"]


def test_a_run_has_the_side_that_was_in_the_machine_and_goes_on_with_no_other(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    operator = floating(house, desk, clock)
    assert answer(told(house, operator, word(clock, "start")))["taken"]
    assert trial_of(house).side == "right"
    assert [said for topic, _, said in desk.written if topic == "/console/run"] == [
        {"rig": "recupera_like", "side": "right", "participant": "T01"}
    ]
    refused = answer(told(house, operator, do(clock, "don", desk.shown().version, side="left")))
    assert "runs with this person" in refused["why"]
    assert answer(told(house, operator, word(clock, "pause")))["taken"]
    desk.side = "left"
    house.shown = desk.shown()
    assert "right arm" in answer(told(house, operator, word(clock, "resume")))["why"]
    desk.side = "right"
    house.shown = desk.shown()
    assert answer(told(house, operator, word(clock, "resume")))["taken"]


def test_the_machine_learns_in_a_rest_that_is_long_enough_and_never_in_a_window(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    operator, trial = floating(house, desk, clock), trial_of(house)
    assert answer(told(house, operator, do(clock, "learn_rest", desk.shown().version)))["taken"]  # not begun yet
    told(house, operator, word(clock, "start"))
    assert OPENS_S < REST_NEEDED_S
    refused = answer(told(house, operator, do(clock, "learn_rest", desk.shown().version)))
    assert not refused["taken"]
    assert "opens in 35 s" in refused["why"]
    clock.t += OPENS_S + 2.0
    trial.tick(clock.t, desk.shown())
    assert "window is open" in trial.why_no_rest(clock.t)
    trial.interrupt(clock.t, "operator")
    assert trial.why_no_rest(clock.t) == ""


def test_a_run_goes_on_while_the_machine_learns_in_a_rest_but_no_window_opens_with_it(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    operator, trial = floating(house, desk, clock), trial_of(house)
    told(house, operator, word(clock, "start"))
    desk.machine.take(Event.MOVE)
    desk.rests = RestLearning(is_active=True)
    clock.t += 10.0
    assert trial.tick(clock.t, desk.shown()) == ""
    assert trial.is_running
    clock.t += OPENS_S
    assert trial.tick(clock.t, desk.shown()) != ""
    assert not trial.is_running
    resume = RunCommand(kind="run", id=name(), made=clock.t, word="resume")
    desk.machine.take(Event.FLOAT)
    assert "learns the arm" in trial.word(resume, clock.t, desk.shown())
    desk.rests = RestLearning(is_active=False)
    assert trial.word(resume, clock.t, desk.shown()) == ""
