"""A pointing session judges touches by window and pace, and refuses times that go back."""

import pytest

import exograv


def played(step_s: float = 0.1) -> exograv.PointingSession:
    session = exograv.PointingSession("training", windows=2)
    session.start(0.0)
    t = next_touch = 0.0
    while not session.is_over:
        session.advance(t)
        if session.picture.screen == "task" and t >= next_touch:
            session.touch(t, 3.0, 4.0)
            next_touch = t + 2.5
        t = round(t + step_s, 6)
    return session


def test_every_touch_in_a_window_is_accepted_with_its_deviation():
    touches = played().to_pandas()
    assert set(touches["window"]) == {1, 2}
    assert touches["is_accepted"].tolist() == [True] * len(touches)
    assert set(touches["deviation_px"]) == {5.0}


def test_a_touch_in_a_rest_is_kept_and_rejected():
    session = exograv.PointingSession("training", windows=1)
    session.start(0.0)
    record = session.touch(1.0, 0.0, 0.0)
    assert not record.is_accepted
    assert len(session.to_pandas()) == 1


def test_times_that_go_back_are_refused():
    session = exograv.PointingSession()
    with pytest.raises(exograv.ExogravError, match="was not started"):
        session.advance(0.0)
    session.start(5.0)
    with pytest.raises(exograv.ExogravError, match="must not go back"):
        session.advance(4.0)
