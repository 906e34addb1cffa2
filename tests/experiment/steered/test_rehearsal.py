"""A rehearsal behaves as a machine does: what is off stands still."""

import pytest

from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.rehearsed_rest import WHOLE_S
from exograv.experiment.steered.requests import DonRequest
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.safety.modes import Event, Mode


class Clock:
    """Clock that a test sets."""

    t = 100.0

    def __call__(self) -> float:
        return self.t


def test_the_arm_stands_still_until_the_machine_carries_it():
    clock = Clock()
    flight = RehearsedFlight(clock)
    still = flight.moment().q_rad
    clock.t += 5.0
    off = flight.moment()
    assert off.mode is Mode.OFF
    assert (off.q_rad, set(off.v_rad_s), flight.skeleton().q_rad) == (still, {0.0}, still)
    assert set(flight.trace(0).q_rad) == {still}
    for event in (Event.TEST, Event.TAKE_ARM):
        flight.lease(clock.t + 1.0, None)
        assert flight.ask(event) == ""
        for _ in range(10):
            clock.t += 0.5
            flight.lease(clock.t + 1.0, None)
    floats = flight.moment()
    assert floats.arm_share == 1.0
    assert all(abs(now - before) > 1e-3 for now, before in zip(floats.q_rad, still, strict=True))
    assert flight.trace(0).q_rad[-1] != still


def go(flight: RehearsedFlight, clock: Clock, seconds: float) -> None:
    """Advance the clock, with a page that steers."""
    until = clock.t + seconds
    while clock.t < until:
        clock.t += 0.5
        flight.lease(clock.t + 1.0, None)
        flight.moment()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def floats(clock: Clock) -> RehearsedFlight:
    """Rehearsal whose known arm floats and feels its weight."""
    flight = RehearsedFlight(clock)
    flight.don(DonRequest(id="don-000001", made_at_s=clock.t, seen_version=0, participant="P-07"))
    for event in (Event.TEST, Event.TAKE_ARM):
        flight.lease(clock.t + 1.0, None)
        assert flight.ask(event) == ""
        go(flight, clock, 6.0)
    assert flight.feel(1.0, 0.0) == ""
    go(flight, clock, GRAVITY_LEVEL_S + 1.0)
    return flight


def test_a_rehearsed_rest_takes_the_weight_moves_the_arm_and_gives_the_weight_back(
    floats: RehearsedFlight, clock: Clock
):
    assert floats.learn_in_rest() == ""
    assert floats.learn_in_rest() != ""
    assert floats.feel(0.5, 0.0) != ""
    stages = list[object]()
    for _ in range(round(2.0 * WHOLE_S) - 2):
        go(floats, clock, 0.5)
        moment = floats.moment()
        assert moment.rests is not None
        assert moment.work is not None
        assert moment.work.kind == "rest"
        stage = moment.rests.stage
        assert stage == "soon" or (moment.mode, moment.gravity_level) == (Mode.MOVING, pytest.approx(0.0, abs=0.02))
        stages += [stage] if stage not in stages else []
    assert stages == ["soon", "moves", "holds"]
    go(floats, clock, GRAVITY_LEVEL_S + 3.0)
    after = floats.moment()
    assert after.rests is not None
    assert (after.mode, after.gravity_level, after.work) == (Mode.FLOATING, pytest.approx(1.0, abs=0.02), None)
    assert (after.rests.is_active, after.rests.rests, after.rests.why_not) == (False, 1, "")


def test_stop_ends_a_rehearsed_rest_which_then_counts_no_motion(floats: RehearsedFlight, clock: Clock):
    assert floats.learn_in_rest() == ""
    go(floats, clock, GRAVITY_LEVEL_S + 2.0)
    floats.stop()
    go(floats, clock, 1.0)
    moment = floats.moment()
    assert moment.rests is not None
    assert (moment.mode, moment.rests.is_active, moment.rests.rests) == (Mode.SAFE, False, 0)


def test_an_arm_that_a_rehearsal_does_not_know_is_not_moved_in_a_rest(clock: Clock):
    flight = RehearsedFlight(clock)
    assert "Identify or check the arm first" in flight.learn_in_rest()
