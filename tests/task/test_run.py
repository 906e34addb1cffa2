"""A run depends only on its events and their times.

The number of ticks, or a restart from a checkpoint, changes nothing.
"""

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.results import json_value
from exograv.task.events import (
    EVENT,
    AcknowledgeAlarm,
    CloseWindow,
    Interrupted,
    OpenWindow,
    Pause,
    Resume,
    Start,
    Stop,
    Tick,
)
from exograv.task.levels import RATE_MAX_PER_S
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol
from exograv.task.records import (
    RECORD,
    AlarmRaised,
    PaceChanged,
    RefusedEvent,
    Resumed,
    RunEnded,
    WindowClosed,
    WindowOpened,
    marker,
)
from exograv.task.run import TaskRun

from .of_run import fed, judged, short_plan, touch

PLAN = short_plan()
END_S = 35.0 + 3 * 22.0 + 2 * 20.0 + 10.0


def of_kind(records, kind) -> list[Any]:
    return [record for record in records if isinstance(record, kind)]


@st.composite
def histories(draw) -> list:
    """Possible events of a run, in order of time."""
    t, events = 0.0, list[Any]([Start(t=0.0)])
    for k in range(draw(st.integers(0, 25))):
        t += draw(st.floats(0.0, 12.0))
        events.append(
            draw(
                st.sampled_from(
                    [
                        Tick(t=t),
                        touch(t, k, late_s=0.0),
                        touch(t - 4.0, k, late_s=4.0),
                        Pause(t=t, why="a question"),
                        Resume(t=t),
                        Resume(t=t, window=2),
                    ]
                )
            )
        )
    return [*events, Tick(t=t + 30.0)]


@given(history=histories())
def test_a_run_that_is_kept_and_restored_at_every_step_says_what_an_uninterrupted_one_says(history: list):
    whole = TaskRun(PLAN)
    expected = fed(whole, history)
    restored, said = TaskRun(PLAN), []
    for event in history:
        said += restored.feed(EVENT.validate_json(event.model_dump_json()))
        restored = TaskRun.from_kept(PLAN, restored.kept())
    assert said == expected
    assert restored.state == whole.state


@settings(max_examples=50)
@given(history=histories(), period_s=st.floats(0.3, 5.0))
def test_how_often_it_is_asked_changes_nothing(history: list, period_s: float):
    seldom, often = TaskRun(PLAN), TaskRun(PLAN)
    expected, said, t = fed(seldom, history), [], 0.0
    for event in history:
        at = getattr(event, "received", event.t)
        while (t := t + period_s) < at:
            said += often.feed(Tick(t=t))
        t = at
        said += often.feed(event)
    assert said == expected


@settings(max_examples=50)
@given(history=histories(), before_s=st.floats(1.0, 8.0))
def test_the_level_that_the_machine_is_asked_for_never_jumps(history: list, before_s: float):
    run, asked = TaskRun(PLAN), [(0.0, 1.0)]
    for event in history:
        at = getattr(event, "received", event.t)
        while (t := asked[-1][0] + before_s) < at:
            run.feed(Tick(t=t))
            asked.append((t, run.made_level(t)))
        run.feed(event)
        asked.append((at, run.made_level(at)))
    for (earlier, level), (later, following) in pairwise(asked):
        assert abs(following - level) <= RATE_MAX_PER_S * (later - earlier) + 1e-9
        assert 0.0 <= following <= 1.0


@given(history=histories())
def test_a_record_is_the_same_again_from_its_marker(history: list):
    for record in fed(TaskRun(PLAN), history):
        text = marker(record)
        assert "\n" not in text
        assert RECORD.validate_json(text) == record


@given(gap_s=st.floats(0.9, 30.0))
def test_the_arrow_is_told_by_the_time_since_the_last_touch_alone(gap_s: float):
    records = fed(TaskRun(PLAN), [Start(t=0.0), touch(36.0, 0, late_s=0.0), Tick(t=min(36.0 + gap_s, 56.9))])
    changes = of_kind(records, PaceChanged)
    told = [(round(one.t - 36.0, 9), one.pace.value) for one in changes if one.t > 36.0]
    expected = [(2.25, "right"), (3.25, "too_long")]
    assert told == [one for one in expected if one[0] <= min(gap_s, 20.9)]


def test_a_touch_in_every_2_75_seconds_makes_8_in_every_window():
    run = TaskRun(PLAN)
    records = fed(run, [Start(t=0.0)])
    for number in range(3):
        opened = 35.0 + 42.0 * number
        records += fed(run, [touch(opened + 2.7 * (k + 1), 10 * number + k) for k in range(8)])
    records += fed(run, [Tick(t=END_S)])
    assert run.state.status == "finished"
    assert of_kind(records, RunEnded)[0].is_complete
    figures = json_value(run.totals().figures())
    assert (figures["windows"], figures["touches"], figures["accepted"], figures["rejected"]) == (3, 24, 24, {})
    assert figures["touches_per_window"] == {"median": 8.0}
    assert figures["deviation_px"] == {"median": 5.0, "q1": 5.0, "q3": 5.0}
    assert figures["deviation_mm"] == {"median": 1.5, "q1": 1.5, "q3": 1.5}


def test_windows_open_and_close_by_the_clock_at_their_own_times_however_late_it_is_asked():
    records = fed(TaskRun(PLAN), [Start(t=100.0), Tick(t=500.0)])
    assert [record.t for record in of_kind(records, WindowOpened)] == [135.0, 177.0, 219.0]
    assert [record.t for record in of_kind(records, WindowClosed)] == [157.0, 199.0, 241.0]


def test_a_window_that_is_broken_off_is_run_again_after_a_notice():
    run = TaskRun(PLAN)
    records = fed(run, [Start(t=0.0), touch(38.0, 0), Pause(t=40.0, why="a question"), Resume(t=60.0), Tick(t=1000.0)])
    opened = [(record.window, record.attempt) for record in of_kind(records, WindowOpened)]
    assert opened == [(1, 1), (1, 2), (2, 1), (3, 1)]
    assert of_kind(records, WindowOpened)[1].t == pytest.approx(60.0 + 3.0 + 7.0)  # Notice, ramp and hold.
    assert [record.is_complete for record in of_kind(records, WindowClosed)] == [False, True, True, True]
    assert run.totals().windows == 3


@pytest.mark.parametrize(
    ("resumed", "opens"),
    [
        ([Pause(t=60.0), Resume(t=61.0)], 77.0),  # as planned
        ([Pause(t=60.0), Resume(t=75.0)], 85.0),  # notice, ramp and hold
        ([Pause(t=60.0), Resume(t=61.0, window=2)], 71.0),
        ([Interrupted(t=61.0), Resume(t=61.0)], 71.0),
    ],
)
def test_a_pause_in_a_rest_shortens_the_rest_only_if_the_operator_names_the_window(resumed: list, opens: float):
    records = fed(TaskRun(PLAN), [Start(t=0.0), Tick(t=60.0), *resumed, Tick(t=90.0)])
    assert [record.t for record in of_kind(records, WindowOpened)] == [35.0, pytest.approx(opens)]


def test_a_run_whose_program_was_away_goes_on_at_the_window_with_another_clock():
    run = TaskRun(PLAN)
    fed(run, [Start(t=5000.0), touch(5038.0, 0), Tick(t=5040.0)])
    again = TaskRun.from_kept(PLAN, run.kept())
    records = fed(again, [Interrupted(t=3.0), touch(2.9, 1, page="new"), Resume(t=4.0), Tick(t=500.0)])
    assert of_kind(records, WindowClosed)[0].by == "interruption"
    assert of_kind(records, WindowClosed)[0].t == 5040.0
    assert judged(records)[0].window is None
    assert [record.window for record in of_kind(records, WindowOpened)] == [1, 2, 3]
    assert again.state.status == "finished"
    assert again.totals().accepted == 1


@pytest.mark.parametrize("away", [Pause(t=END_S - 5.0), Interrupted(t=END_S + 100.0)])
def test_a_run_that_is_resumed_after_its_last_window_is_finished_at_once(away: Pause | Interrupted):
    run = TaskRun(PLAN)
    fed(run, [Start(t=0.0), Tick(t=END_S - 5.0)])
    again = TaskRun.from_kept(PLAN, run.kept())
    records = fed(again, [away, Resume(t=away.t + 1.0)])
    assert again.state.status == "finished"
    assert [record.is_complete for record in of_kind(records, RunEnded)] == [True]
    assert not of_kind(records, RefusedEvent)


def test_after_a_stop_nothing_opens_and_the_level_goes_home():
    run = TaskRun(PLAN)
    records = fed(run, [Start(t=0.0), Stop(t=40.0, why="tired"), Tick(t=500.0)])
    assert run.state.status == "stopped"
    assert of_kind(records, RunEnded)[0].why == "tired"
    assert [run.made_level(t) for t in (40.0, 42.5, 45.0, 500.0)] == [0.0, 0.5, 1.0, 1.0]


@pytest.mark.parametrize(
    ("events", "why"),
    [
        ([Start(t=0.0), Start(t=1.0)], "a run starts once"),
        ([Pause(t=0.0)], "only a running run"),
        ([Start(t=0.0), Resume(t=1.0)], "only a paused run"),
        ([Start(t=0.0), Pause(t=1.0), Resume(t=2.0, window=9)], "windows are 1 to 3"),
        ([Start(t=0.0), AcknowledgeAlarm(t=1.0, alarm=0)], "no alarm 0"),
    ],
)
def test_what_cannot_be_now_is_refused_with_the_reason_and_changes_nothing(events: list, why: str):
    run = TaskRun(PLAN)
    records = fed(run, events[:-1])
    before = run.state
    (refusal,) = of_kind(run.feed(events[-1]), RefusedEvent)
    assert why in refusal.why
    assert run.state == before.model_copy(update={"t": run.state.t})
    assert not of_kind(records, RefusedEvent)


def test_a_passive_protocol_is_not_run_on_an_active_machine():
    with pytest.raises(ConfigError, match="is for a passive machine"):
        TaskPlan(load_protocol("flight"), "active")


def test_a_sham_run_says_what_an_active_one_says():
    sham = TaskPlan(PLAN.loaded, "sham", PLAN.screen)
    history = [Start(t=0.0), touch(38.0, 0), Tick(t=300.0)]
    assert fed(TaskRun(sham), history) == fed(TaskRun(PLAN), history)
    run = TaskRun(sham)
    fed(run, history[:2])
    assert run.made_level(38.0) == 1.0


@pytest.mark.parametrize("text", ["", "{}x", '{"status": "flying"}', '{"phase": 500}', '{"t": NaN}', "\x00\xff"])
def test_a_kept_state_that_is_none_is_refused(text: str):
    with pytest.raises(ConfigError, match=r"Start a new run|was started"):
        TaskRun.from_kept(PLAN, text)


def test_a_state_of_another_protocol_is_refused():
    run = TaskRun(PLAN)
    run.feed(Start(t=0.0))
    with pytest.raises(ConfigError, match="from another protocol than 'flight'"):
        TaskRun.from_kept(TaskPlan(load_protocol("flight"), "passive"), run.kept())


FLIGHT = short_plan("flight", windows=2)


def test_a_hand_opens_the_windows_of_a_flight_and_the_clock_closes_them():
    records = fed(TaskRun(FLIGHT), [Start(t=0.0), OpenWindow(t=50.0, by="hand"), Tick(t=90.0)])
    (closed,) = of_kind(records, WindowClosed)
    assert (closed.t, closed.by, closed.is_complete, closed.marks) == (72.0, "clock", True, ())


def test_a_window_that_the_aircraft_never_closes_ends_after_some_overtime_and_says_so():
    records = fed(TaskRun(FLIGHT), [Start(t=0.0), OpenWindow(t=50.0, by="aircraft"), Tick(t=90.0)])
    (closed,) = of_kind(records, WindowClosed)
    assert (closed.t, closed.marks) == (77.0, ("overtime",))


def test_a_window_that_is_closed_early_is_marked_as_short():
    events = [Start(t=0.0), OpenWindow(t=50.0, by="hand"), CloseWindow(t=60.0, by="hand")]
    (closed,) = of_kind(fed(TaskRun(FLIGHT), events), WindowClosed)
    assert closed.marks == ("short",)


def test_the_operator_names_the_window_that_is_flown_next():
    events = [Start(t=0.0), Pause(t=1.0), Resume(t=2.0, window=2), OpenWindow(t=50.0, by="hand"), Tick(t=80.0)]
    run = TaskRun(FLIGHT)
    records = fed(run, [*events, OpenWindow(t=90.0, by="aircraft"), CloseWindow(t=112.0, by="aircraft")])
    assert [record.window for record in of_kind(records, WindowOpened)] == [2, 1]
    assert run.state.status == "finished"


@pytest.mark.parametrize(
    ("plan", "event", "why"),
    [
        (PLAN, OpenWindow(t=40.0, by="hand"), "the clock opens"),
        (PLAN, CloseWindow(t=40.0, by="hand"), "the clock closes"),
        (FLIGHT, CloseWindow(t=40.0, by="hand"), "no window is open"),
    ],
)
def test_who_opens_and_closes_windows_is_the_protocols_to_say(plan: TaskPlan, event, why: str):
    run = TaskRun(plan)
    fed(run, [Start(t=0.0), Tick(t=40.0)])
    (refusal,) = of_kind(run.feed(event), RefusedEvent)
    assert why in refusal.why


def test_an_announcement_that_contradicts_g_is_an_alarm_until_it_is_acknowledged():
    run = TaskRun(FLIGHT)
    records = fed(run, [Start(t=0.0), OpenWindow(t=50.0, by="aircraft", confirmed=False)])
    (alarm,) = of_kind(records, AlarmRaised)
    assert [one.is_acknowledged for one in run.state.alarms] == [False]
    run.feed(AcknowledgeAlarm(t=51.0, alarm=alarm.alarm))
    assert [one.is_acknowledged for one in run.state.alarms] == [True]
    assert run.state.windows[0].marks == ("not confirmed",)


def test_a_resumed_run_waits_until_the_level_has_come_home():
    run = TaskRun(PLAN)
    (resumed,) = of_kind(fed(run, [Start(t=0.0), Pause(t=40.0), Resume(t=40.0)]), Resumed)
    assert resumed.approach_t == 45.0


def test_a_touch_is_not_counted_in_a_window_of_another_clock():
    run = TaskRun(PLAN)
    fed(run, [Start(t=0.0), Tick(t=50.0), Interrupted(t=40.0)])
    (one,) = judged(run.feed(touch(39.0, 0)))
    assert one.window is None
