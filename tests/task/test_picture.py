"""The participant's page shows only the task. The operator's page shows the course of the run, but not a sham."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.task.events import Pause, Start, Tick
from exograv.task.picture import ParticipantPicture, operator_picture, participant_picture
from exograv.task.plan import TaskPlan
from exograv.task.run import TaskRun

from .of_run import fed, short_plan, touch

PLAN = short_plan()


def seen(t: float, *events, plan: TaskPlan = PLAN) -> ParticipantPicture:
    run = TaskRun(plan)
    fed(run, [Start(t=0.0), *events, Tick(t=t)])
    return participant_picture(plan, run.state, t)


def test_a_rest_counts_down_to_the_window_and_shows_no_target():
    picture = seen(30.0)
    assert (picture.screen, picture.target, picture.arrow) == ("rest", None, None)
    assert (picture.window, picture.windows, picture.countdown_s) == (1, 3, pytest.approx(5.0))


def test_a_window_shows_half_a_target_of_its_size_in_millimetres_and_counts_down_to_its_end():
    picture = seen(40.0)
    assert picture.screen == "task"
    assert picture.target is not None
    assert picture.target.visible != "whole"
    assert picture.diameter_px == pytest.approx(40.0 / 0.3)
    assert picture.countdown_s == pytest.approx(17.0)


@pytest.mark.parametrize(("t", "shape"), [(36.0, "down"), (38.0, None), (39.0, "up")])
def test_the_arrow_is_there_in_a_window_only_and_by_the_time_since_its_opening(t: float, shape: str | None):
    arrow = seen(t).arrow
    assert (None if arrow is None else arrow.shape) == shape


def test_an_accepted_touch_begins_the_arrow_anew():
    arrow = seen(40.0, touch(39.5, 0)).arrow
    assert arrow is not None
    assert arrow.shape == "down"


def test_a_pause_and_the_end_are_shown():
    assert seen(45.0, Pause(t=40.0)).screen == "paused"
    assert seen(500.0).screen == "end"
    assert participant_picture(PLAN, TaskRun(PLAN).state, 0.0).screen == "welcome"


@given(t=st.floats(0.0, 200.0))
def test_a_sham_looks_the_same_to_participant_and_operator(t: float):
    sham = TaskPlan(PLAN.loaded, "sham", PLAN.screen)
    pictures = []
    for plan in (PLAN, sham):
        run = TaskRun(plan)
        fed(run, [Start(t=0.0), touch(38.0, 0), Tick(t=t)])
        at = run.state.t
        pictures.append((participant_picture(plan, run.state, at), operator_picture(plan, run.state, at)))
    assert pictures[0] == pictures[1]


def test_the_operator_sees_deviations_per_window_and_what_is_left():
    run = TaskRun(PLAN)
    fed(run, [Start(t=0.0), touch(38.0, 0), touch(38.1, 1), touch(80.0, 2), Tick(t=90.0)])
    picture = operator_picture(PLAN, run.state, 90.0)
    assert [(one.number, one.touches, one.accepted) for one in picture.windows] == [(1, 2, 1), (2, 1, 1)]
    deviation = picture.windows[0].deviation_px
    assert deviation is not None
    assert deviation.median == 5.0
    assert (picture.phase.value, picture.gravity_level, picture.left_s) == ("window", 0.0, pytest.approx(61.0))
    assert picture.totals.rejected == {"bounce": 1}
