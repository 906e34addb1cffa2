"""Every touch counts exactly once, in the window of its contact, with its deviation or the reason of its rejection."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.task.events import Distance, Return, Start, Tick
from exograv.task.pace import Pace
from exograv.task.pointing import SENTENCES, RejectionReason
from exograv.task.records import TouchRecord
from exograv.task.run import TaskRun

from .of_run import SCREEN, fed, judged, short_plan, touch

PLAN = short_plan()
OPENS = 35.0
CLOSES = OPENS + 22.0


def in_window(*events, plan=PLAN) -> list[TouchRecord]:
    """Judge touches of a run whose first window opens at 35 s and closes at 57 s."""
    return judged(fed(TaskRun(plan), [Start(t=0.0), *events]))


def test_a_touch_is_scored_in_pixels_and_millimetres():
    (one,) = in_window(touch(38.0, 0))
    assert one.is_accepted
    assert (one.deviation_x_px, one.deviation_y_px, one.deviation_px) == (3.0, 4.0, 5.0)
    assert one.deviation_mm == pytest.approx(1.5)
    assert (one.window, one.attempt, one.interval_s, one.pace) == (1, 1, 3.0, Pace.RIGHT)


@given(x=st.floats(-400.0, 400.0), y=st.floats(-400.0, 400.0))
def test_millimetres_are_pixels_times_pitch(x: float, y: float):
    (one,) = in_window(touch(38.0, 0, x_px=x, y_px=y, target_x_px=0.0, target_y_px=0.0))
    assert one.deviation_px == pytest.approx(math.hypot(x, y))
    assert one.deviation_mm == pytest.approx(SCREEN.pitch_x_mm * one.deviation_px)


def test_without_a_calibrated_screen_there_are_no_millimetres():
    (one,) = in_window(touch(38.0, 0), plan=short_plan(screen=None))
    assert one.is_accepted
    assert (one.deviation_x_mm, one.deviation_y_mm, one.deviation_mm) == (None, None, None)


REFUSED = {
    "before the window": (touch(34.9, 0), RejectionReason.OUTSIDE),
    "at its last moment": (touch(CLOSES, 0), RejectionReason.OUTSIDE),
    "second finger": (touch(38.0, 0, is_primary=False), RejectionReason.SECOND),
    "palm, 36 mm": (touch(38.0, 0, contact_px=120.0), RejectionReason.PALM),
    "mouse": (touch(38.0, 0, pointer="mouse"), RejectionReason.POINTER),
    "at the edge": (touch(38.0, 0, x_px=1900.0), RejectionReason.OFF_TARGET),
    "from the future": (touch(38.0, 0, late_s=-1.0), RejectionReason.UNTIMED),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_pointing_is_kept_with_its_reason(case: str):
    told, reason = REFUSED[case]
    (one,) = in_window(told)
    assert (one.is_accepted, one.reason) == (False, reason)
    assert one.deviation_px > 0.0


def test_each_reason_has_a_sentence():
    assert set(SENTENCES) == set(RejectionReason)


def test_the_first_moment_of_a_window_belongs_to_it():
    assert in_window(touch(OPENS, 0))[0].is_accepted


def test_a_touch_that_bounces_and_one_without_return_do_not_count_and_do_not_begin_a_new_interval():
    reasons = [one.reason for one in in_window(touch(38.0, 0), touch(38.1, 1), touch(38.7, 2), touch(38.85, 3))]
    assert reasons == [None, RejectionReason.BOUNCE, RejectionReason.NO_RETURN, None]


def test_a_touch_that_is_sent_again_is_counted_once():
    first, again = in_window(touch(38.0, 7), touch(38.0, 7, late_s=9.0))
    assert (first.is_accepted, again.reason) == (True, RejectionReason.REPEATED)


def test_the_number_of_touches_counts_a_touch_once_that_the_page_sent_twice():
    run = TaskRun(PLAN)
    fed(run, [Start(t=0.0), touch(38.0, 7), touch(38.0, 7, late_s=9.0), touch(41.0, 8)])
    told = run.totals()
    assert (told.touches, told.accepted, told.rejected) == (2, 2, {"repeated": 1})
    assert run.state.windows[0].touches == 2


def test_another_opening_of_the_page_counts_from_0_again():
    assert all(one.is_accepted for one in in_window(touch(38.0, 0), touch(41.0, 0, page="q")))


def test_touches_that_waited_for_the_connection_count_in_the_window_in_which_they_fell():
    late = in_window(touch(38.0, 0, late_s=60.0), touch(40.75, 1, late_s=57.3), touch(41.0, 2, late_s=57.1))
    assert [(one.window, one.reason) for one in late] == [(1, None), (1, None), (1, RejectionReason.NO_RETURN)]


@pytest.mark.parametrize(
    ("check", "back", "not_back"),
    [
        ("sensor", Return(t=39.0), Distance(t=39.0, fingertip_m=0.0, joints_rad=0.0)),
        ("fingertip", Distance(t=39.0, fingertip_m=0.09), Distance(t=39.0, fingertip_m=0.11, joints_rad=0.0)),
        ("joints", Distance(t=39.0, joints_rad=0.25), Distance(t=39.0, joints_rad=0.27, fingertip_m=0.0)),
    ],
)
def test_the_return_is_what_the_protocol_asks_for(check: str, back, not_back):
    plan = short_plan(return_check=check)
    assert in_window(touch(38.0, 0), back, touch(40.5, 1), plan=plan)[1].is_accepted
    assert in_window(touch(38.0, 0), not_back, touch(40.5, 1), plan=plan)[1].reason is RejectionReason.NO_RETURN
    # A delayed touch finds the return before its contact, and not the one after it.
    late = touch(40.5, 1, late_s=5.0)
    assert in_window(touch(38.0, 0), back, Tick(t=44.0), late, plan=plan)[1].is_accepted


def test_a_return_after_a_late_touch_does_not_excuse_it():
    plan = short_plan(return_check="sensor")
    late = touch(40.5, 1, late_s=3.0)
    assert in_window(touch(38.0, 0), Return(t=41.0), late, plan=plan)[1].reason is RejectionReason.NO_RETURN


@given(
    sent=st.lists(
        st.tuples(st.integers(300, 1200), st.integers(0, 40), st.floats(-0.3, 50.0), st.booleans()), max_size=25
    )
)
def test_every_touch_is_counted_exactly_once_and_accepted_ones_lie_in_windows_apart(sent):
    touches = [touch(0.1 * t, k, late_s=late, is_primary=fine) for t, k, late, fine in sent]
    run = TaskRun(PLAN)
    arrived = sorted(touches, key=lambda one: one.received)
    records = judged(fed(run, [Start(t=0.0), *arrived]))
    assert len(records) == len(touches)
    totals = run.totals()
    assert len(touches) == totals.accepted + sum(totals.rejected.values())
    assert totals.touches == len(touches) - totals.rejected.get("repeated", 0)
    windows = {window.number: (window.opened, window.closed) for window in run.state.windows}
    accepted = [one for one in records if one.is_accepted]
    assert len({one.sequence for one in accepted}) == len(accepted)
    for one in accepted:
        assert one.window is not None
        opened, closed = windows[one.window]
        assert opened <= one.t
        assert closed is None or one.t < closed
    for earlier, later in pairwise(accepted):
        assert earlier.window != later.window or later.t - earlier.t >= PLAN.protocol.pointing.return_after_s
