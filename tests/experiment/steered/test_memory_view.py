"""A page's time is placed on the rig's clock by the ticks around it."""

import contextlib
from collections.abc import Iterator

import numpy as np
import pytest

from exograv.experiment.steered.memory_view import FlightMemoryView
from exograv.recording.encoding import tick_dtype
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.recorder.recorder_process import EVENT, RING_EVENTS, RING_TICKS, Inlet

JOINTS = 2
AHEAD_S = 100.0
"""Lead of the rig's clock over CLOCK_MONOTONIC at the first tick [s]."""


@contextlib.contextmanager
def seen(clocks: list[tuple[float, float]], is_looked: bool = True) -> Iterator[FlightMemoryView]:
    """View of ticks with these values of CLOCK_MONOTONIC and of the rig's clock [s]."""
    with (
        contextlib.closing(Ring(tick_dtype(JOINTS), RING_TICKS)) as ticks,
        contextlib.closing(Ring(EVENT, RING_EVENTS)) as events,
        contextlib.closing(FlightMemoryView(Inlet(JOINTS, ticks.name, events.name, ""))) as view,
    ):
        for monotonic, now in clocks:
            row = np.zeros((), tick_dtype(JOINTS))
            row["monotonic"], row["now"] = monotonic, now
            ticks.put(row)
        if is_looked:
            view.look()
        yield view


def test_a_touch_before_a_wait_of_the_drives_keeps_its_place_beside_the_arm():
    before = [(0.1 * k, AHEAD_S + 0.1 * k) for k in range(10)]
    after = [(5.0 + 0.1 * k, AHEAD_S + 1.0 + 0.1 * k) for k in range(10)]
    with seen(before + after) as view:
        assert view.rig_time(0.55) == pytest.approx(AHEAD_S + 0.55)
        assert view.rig_time(5.55) == pytest.approx(AHEAD_S + 1.55)


def test_ticks_that_came_after_the_last_look_place_a_touch_too():
    with seen([(0.0, AHEAD_S), (0.02, AHEAD_S + 0.004)], is_looked=False) as view:
        assert view.rig_time(0.01) == pytest.approx(AHEAD_S + 0.002)


def test_while_the_drives_wait_the_rigs_clock_never_runs_backwards():
    with seen([(0.0, AHEAD_S), (1.0, AHEAD_S + 0.001), (1.1, AHEAD_S + 0.1)]) as view:
        times = [view.rig_time(t) for t in np.linspace(-0.5, 1.5, 41)]
    assert all(time is not None for time in times)
    assert (np.diff(np.array(times, dtype=float)) >= 0.0).all()


def test_before_the_first_tick_no_time_is_known():
    with seen([]) as view:
        assert view.rig_time(1.0) is None


def test_a_tick_without_the_computers_clock_places_nothing():
    with seen([(np.nan, 3.0), (1.0, AHEAD_S)]) as view:
        assert view.rig_time(2.0) == pytest.approx(AHEAD_S + 1.0)
