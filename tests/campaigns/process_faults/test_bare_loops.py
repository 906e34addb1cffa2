"""Bare loops beside a flight end with it, and a pause counts on the processor and in the time in which it was."""

import pytest

from exograv.campaigns.process_faults.bare_loops import LATE_S, HostPause, bare_loops, paused_s

PAUSES = [HostPause(10.0, 0.004, 0), HostPause(10.5, 0.002, 0), HostPause(10.2, 0.005, 1)]


@pytest.mark.parametrize(
    ("begin_t", "end_t", "expected_s"), [(9.0, 11.0, 0.006), (10.3, 11.0, 0.002), (9.0, 9.997, 0.004), (8.0, 9.0, 0.0)]
)
def test_pauses_of_one_processor_add_up(begin_t: float, end_t: float, expected_s: float):
    assert paused_s(PAUSES, begin_t, end_t) == pytest.approx(expected_s)


@pytest.mark.long
def test_bare_loops_note_late_wake_ups_only():
    with bare_loops() as pauses:
        pass
    if pauses is None:
        pytest.skip("no real-time priority here")
    assert all(one.late_s > LATE_S for one in pauses)
