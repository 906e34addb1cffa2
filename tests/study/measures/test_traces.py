"""A trace is the median over windows of the values at the same time since their opening."""

import numpy as np
import pytest

from exograv.study.measures.traces import STEP_S, TIMES_S, WindowTrace, flown_levels, trace_rows, window_trace

KEY = {"participant": "AAAA", "protocol": "flight", "session": 1}


def test_a_joint_that_turns_evenly_has_that_speed_at_all_times_that_were_recorded():
    t = np.arange(95.0, 120.0, 0.01)
    trace = window_trace(100.0, t, np.outer(t, [0.3, 0.4]), np.where(t < 100.0, 1.0, 0.0))
    recorded = (TIMES_S > -4.8) & (TIMES_S < 19.8)
    assert trace.speed[recorded] == pytest.approx(0.5)
    assert np.isnan(trace.speed[TIMES_S < -5.2]).all()
    assert trace.level[recorded & (TIMES_S > STEP_S)] == pytest.approx(0.0)
    assert trace.level[recorded & (TIMES_S < -STEP_S)] == pytest.approx(1.0)


def test_the_aircraft_says_what_was_felt_where_there_is_one():
    levels = flown_levels([{"t": t, "g": (0.0, 0.6, 0.8)} for t in (0.0, 200.0)], [100.0])
    still = WindowTrace(np.ones_like(TIMES_S), np.zeros_like(TIMES_S))
    rows = trace_rows(KEY, [still], [0.5 * level for level in levels])
    assert {row["felt_level"] for row in rows} == {0.5}
    assert {row["participant"] for row in rows} == {"AAAA"}


def test_one_window_that_went_wrong_does_not_move_the_median_and_a_missing_one_does_not_count():
    traces = [WindowTrace(np.full_like(TIMES_S, v), np.full_like(TIMES_S, v)) for v in (1.0, 1.0, 9.0, np.nan)]
    assert {row["joint_speed_rad_per_s"] for row in trace_rows(KEY, traces, [])} == {1.0}


def test_a_session_without_ticks_and_aircraft_has_no_trace():
    assert trace_rows(KEY, [], []) == []
