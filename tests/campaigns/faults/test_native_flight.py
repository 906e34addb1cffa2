"""A flight whose ticks run in native code is the flight in Python, tick by tick, with and without faults."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from exograv.campaigns.faults import healthy
from exograv.campaigns.faults.fault_participants import load_participant, prepare_participant
from exograv.campaigns.faults.fault_plant import FaultParticipant, FlightStart, TruthSample, TwinPlant
from exograv.campaigns.faults.flight import FaultFlight
from exograv.campaigns.faults.healthy import HealthyUse, fly_healthy, start_of
from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict, fly
from exograv.loop.native_ticks import NativeTicks

TICKS = 1500
OF_THE_WORLD = ("F25", "F26", "F28", "F29", "F30", "F49", "F50", "F51")
"""Faults that change the world or control, and no signal: their ticks stay native."""

OF_SIGNALS = ("F02", "F09", "F17", "control")
"""Faults whose ticks are native up to the onset."""


@pytest.fixture(scope="module")
def participant(tmp_path_factory: pytest.TempPathFactory) -> FaultParticipant:
    return load_participant(prepare_participant(3, 0, 2, tmp_path_factory.mktemp("person")))


def in_python(participant: FaultParticipant, scenario: Scenario) -> ScenarioVerdict:
    with patch.object(NativeTicks, "of", autospec=True, return_value=None):
        return fly(participant, scenario)


def healthy_flight(participant: FaultParticipant, start: FlightStart) -> tuple[FaultFlight, list[TruthSample]]:
    stand = TwinPlant(participant, start)
    flight = FaultFlight(participant, stand, start.posture, ())
    flight.fly(TICKS)
    return flight, stand.sights()


@pytest.mark.slow
@pytest.mark.parametrize("number", range(2))
@pytest.mark.parametrize("fault", OF_THE_WORLD + OF_SIGNALS)
def test_both_flights_have_the_same_verdict_to_the_last_bit(participant: FaultParticipant, fault: str, number: int):
    scenario = Scenario(5, number, (fault,))
    assert repr(fly(participant, scenario)) == repr(in_python(participant, scenario))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_both_healthy_flights_pass_through_the_same_states(participant: FaultParticipant, number: int):
    use, start = start_of(participant, Scenario(5, number, ()))
    assert use.kind == ("quiet", "lively", "tremor")[number]
    flight, states = healthy_flight(participant, start)
    assert flight.is_native
    with patch.object(NativeTicks, "of", autospec=True, return_value=None):
        flight, in_python = healthy_flight(participant, start)
    assert not flight.is_native
    for ours, theirs in zip(states, in_python, strict=True):
        np.testing.assert_array_equal(ours.q, theirs.q)
        np.testing.assert_array_equal(ours.v, theirs.v)


@pytest.mark.slow
def test_the_oracle_sees_a_torque_outside_the_envelope(participant: FaultParticipant):
    _, start = start_of(participant, Scenario(5, 0, ()))
    flight = FaultFlight(participant, TwinPlant(participant, start), start.posture, ())
    flight._oracle._limits = replace(participant.limits, torque_max_Nm=np.full(4, 0.5))
    for _ in range(3):
        flight.fly_segment(300, 100)
    course = flight.watch.course
    assert flight.is_native
    assert 850 < course.violated_ticks <= 900  # each tick once, over several judgements
    assert "drives' limit" in course.violations[0]


@pytest.mark.slow
def test_a_healthy_flight_that_the_guard_stops_ends_there(
    participant: FaultParticipant, monkeypatch: pytest.MonkeyPatch
):
    use, start = start_of(participant, Scenario(5, 1, ()))
    strong = HealthyUse(use.kind, 1), start._replace(moves=np.full(4, 60.0))
    monkeypatch.setattr(healthy, "start_of", lambda *_: strong)
    monkeypatch.setattr(healthy, "SEGMENT_TICKS", 4000)
    course = fly_healthy(participant, Scenario(5, 1, ())).course
    assert course.stopped_tick == course.ticks - 1 < 59_999
    assert course.reason is not None
