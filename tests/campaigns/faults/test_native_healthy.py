"""A flight of healthy use in native code is the flight that the fault campaign judges, tick by tick."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.campaigns.faults.fault_participants import load_participant, prepare_participant
from exograv.campaigns.faults.fault_plant import FaultParticipant, TwinPlant
from exograv.campaigns.faults.flight import FaultFlight
from exograv.campaigns.faults.healthy import start_of
from exograv.campaigns.faults.native_healthy import NativeHealthyFlight
from exograv.campaigns.faults.scenario import Scenario

TICKS = 1500


@pytest.fixture(scope="module")
def participant(tmp_path_factory: pytest.TempPathFactory) -> FaultParticipant:
    return load_participant(prepare_participant(3, 0, 2, tmp_path_factory.mktemp("person")))


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1, 2])
def test_both_flights_end_in_the_same_posture_to_the_last_bit(participant: FaultParticipant, number: int):
    use, start = start_of(participant, Scenario(5, number, ()))
    native = NativeHealthyFlight(participant, start)
    course = native.fly(TICKS)
    assert native.is_native
    stand = TwinPlant(participant, start)
    judged = FaultFlight(participant, stand, start.posture, ())
    judged.fly_segment(TICKS, TICKS)
    assert (course.ticks, course.stopped_tick) == (judged.watch.course.ticks, judged.watch.course.stopped_tick)
    assert course.crashed is None
    assert (course.violated_ticks, judged.watch.course.violated_ticks) == (0, 0)
    ours, theirs = native.twin.truth, stand.sights()[-1]
    np.testing.assert_array_equal(ours.q, theirs.q)
    np.testing.assert_array_equal(ours.v, theirs.v)
    assert use.kind == ("quiet", "lively", "tremor")[number]


@pytest.mark.slow
def test_the_oracle_sees_a_torque_outside_the_envelope(participant: FaultParticipant, monkeypatch: pytest.MonkeyPatch):
    _, start = start_of(participant, Scenario(5, 0, ()))
    monkeypatch.setattr("exograv.campaigns.faults.native_healthy.SEGMENT_TICKS", 300)
    native = NativeHealthyFlight(participant, start)
    native._oracle._limits = replace(participant.limits, torque_max_Nm=np.full(4, 0.5))
    course = native.fly(1000)
    assert 900 < course.violated_ticks <= 1000  # each tick once, over several judgements
    assert "drives' limit" in course.violations[0]


@pytest.mark.slow
def test_a_flight_that_the_guard_stops_ends_there(participant: FaultParticipant):
    _, start = start_of(participant, Scenario(5, 1, ()))
    native = NativeHealthyFlight(participant, start._replace(moves=np.full(4, 60.0)))
    course = native.fly(10 * TICKS)
    assert course.stopped_tick == course.ticks - 1 < 10 * TICKS - 1
    assert course.reason is not None
