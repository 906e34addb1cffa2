"""A timeline has no gap, opens every window at its level, and contains no sudden change of the level."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.task.levels import RATE_MAX_PER_S, slewed, slewing_s
from exograv.task.protocol import load_protocol
from exograv.task.schedule import PhaseKind, timeline

SHIPPED = ("training", "familiarisation", "flight", "parabola")
LAID_OUT = {name: timeline(load_protocol(name).settings) for name in SHIPPED}
NAMES = pytest.mark.parametrize("name", LAID_OUT)
ROUNDING_S = 1e-9


@NAMES
def test_phases_follow_each_other_without_gap(name: str):
    phases = LAID_OUT[name].phases
    assert phases[0].start_s == 0.0
    for phase, following in pairwise(phases):
        assert following.start_s == phase.end_s
        assert phase.duration_s > 0.0


@NAMES
def test_31_windows_of_22_seconds(name: str):
    windows = LAID_OUT[name].windows
    assert list(windows) == list(range(1, 32))
    assert {window.duration_s for window in windows.values()} == {22.0}


def test_31_cycles_of_180_seconds_take_93_minutes():
    training = load_protocol("training").settings
    assert timeline(training.model_copy(update={"rests": "cycle_180"})).duration_s == pytest.approx(93 * 60)
    assert LAID_OUT["flight"].duration_s == pytest.approx(93 * 60)


@NAMES
@given(s=st.floats(0.0, 7000.0), ds=st.floats(0.0, 10.0))
def test_the_machine_is_asked_for_no_faster_change_than_allowed(name: str, s: float, ds: float):
    line = LAID_OUT[name]
    change = line.made_level_at(s + ds, line.protocol.exo) - line.made_level_at(s, line.protocol.exo)
    assert abs(change) <= RATE_MAX_PER_S * ds + ROUNDING_S


def test_a_training_window_is_weightless_from_its_opening_to_its_end_and_rest_is_earth():
    line = LAID_OUT["training"]
    for window in line.windows.values():
        assert [line.level_at(s) for s in (window.start_s - 2.0, window.start_s, window.end_s - 1e-6)] == [0.0] * 3
    assert all(phase.level_from == phase.level_to == 1.0 for phase in line.phases if phase.kind is PhaseKind.REST)


@given(s=st.floats(-10.0, 1e5))
def test_a_sham_machine_is_asked_for_nothing_while_the_protocol_says_the_same(s: float):
    line = LAID_OUT["training"]
    assert line.made_level_at(s, "sham") == line.made_level_at(s, "passive") == 1.0
    assert line.made_level_at(s, "active") == line.level_at(s)


def test_a_flight_has_hypergravity_before_and_after_each_parabola_and_the_machine_makes_none_of_it():
    line = LAID_OUT["flight"]
    for window in line.windows.values():
        index = line.phases.index(window)
        kinds = [phase.kind for phase in line.phases[index - 3 : index + 4]]
        assert kinds == [PhaseKind.RAMP, PhaseKind.HYPER, PhaseKind.RAMP, PhaseKind.WINDOW, *kinds[:3][::-1]]
        assert line.phases[index - 2].level_from == 1.8
        assert line.phases[index - 2].duration_s == 20.0
    assert {line.made_level_at(0.5 * k, "passive") for k in range(11_000)} == {1.0}


def test_a_parabola_on_the_ground_has_the_flight_s_rhythm_and_ramps_that_the_machine_may_make():
    ground, flight = LAID_OUT["parabola"], LAID_OUT["flight"]
    for number, window in ground.windows.items():
        index = ground.phases.index(window)
        around = ground.phases[index - 3 : index + 4]
        assert [phase.kind for phase in around] == [
            phase.kind for phase in flight.phases[flight.phases.index(flight.windows[number]) - 3 :][:7]
        ]
        assert around[0].start_s == pytest.approx(window.start_s - 30.0)
        assert around[-1].end_s == pytest.approx(window.end_s + 30.0)
        assert around[1].level_from == around[5].level_to == 1.8
        assert (window.level_from, window.level_to) == (0.0, 0.0)
    rates = [abs(one.level_to - one.level_from) / one.duration_s for one in ground.phases]
    assert max(rates) <= RATE_MAX_PER_S + 1e-12
    starts = [window.start_s for window in ground.windows.values()]
    assert [later - earlier for earlier, later in pairwise(starts)] == pytest.approx([180.0] * 30)


@NAMES
def test_an_approach_begins_in_rest_and_ends_with_its_window(name: str):
    line = LAID_OUT[name]
    for number, window in line.windows.items():
        start = line.approach_s(number)
        assert start <= window.start_s
        assert line.level_at(start) == line.level_at(start - 1e-9) == 1.0


@given(level=st.floats(0.0, 1.8), target=st.floats(0.0, 1.8), seconds=st.floats(-1.0, 20.0))
def test_a_level_on_its_way_arrives_and_never_overshoots(level: float, target: float, seconds: float):
    reached = slewed(level, target, seconds)
    assert min(level, target) <= reached <= max(level, target)
    assert abs(reached - level) <= RATE_MAX_PER_S * max(seconds, 0.0) + ROUNDING_S
    assert slewed(level, target, slewing_s(level, target) + ROUNDING_S) == target
