"""Faults are found through a driver too, at its interface, at a drive, or at the person behind it."""

import pickle
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.campaigns.faults import drive_plant as driven
from exograv.campaigns.faults.campaign import Campaign
from exograv.campaigns.faults.drive_plant import DrivePlant, by_tick, driven_ground
from exograv.campaigns.faults.driver_faults import ALL, AT_DRIVES, BUSES, ONLY_DRIVES, injected_by, injector_of
from exograv.campaigns.faults.fault_participants import arm_of
from exograv.campaigns.faults.fault_plant import TruthSample, TwinPlant
from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.injector import Injector
from exograv.campaigns.faults.oracle import Judgement
from exograv.campaigns.faults.scenario import Scenario, _verdict, fly, is_bad
from exograv.campaigns.faults.scenario_log import ScenarioLog, TruthWatch
from exograv.errors import ConfigError, RigError
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.person_limits import person_limits
from exograv.rig.drives.opening import DRIVERS
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

SEED = 1000
WARM_S = 900.0


def test_every_fault_says_what_it_is_done_to_and_one_of_a_drive_is_nothing_at_the_interface():
    for name in ALL:
        assert injected_by(name) in ("interface", "drive", "person", "world", "control", "guard")
    for injector in AT_DRIVES.values():
        assert injector.measured is Injector.measured
        assert injector.commanded is Injector.commanded
        assert injector.act is not Injector.act
    assert set(BUSES) <= set(DRIVERS)


@pytest.mark.parametrize("name", sorted(set(AT_DRIVES) & set(FAULTS)))
def test_what_a_drive_has_itself_is_the_same_fault_with_the_same_draws(name: str):
    there, here = (injector_of(name, bus)(np.random.default_rng(7), 4, 100) for bus in ("udp", None))
    assert type(there) is not type(here)
    assert there.joint == here.joint
    assert getattr(there, "factor", None) == getattr(here, "factor", None)
    assert (there.__doc__ or "").split(":")[0] == (here.__doc__ or "").split(":")[0] == name


def test_a_campaign_through_drives_flies_the_numbers_of_the_twin_and_then_what_only_drives_have():
    twin, driven = Campaign(scenarios=30), Campaign(scenarios=30, through="udp")
    assert len(twin.numbers) == 30
    assert [driven.scenario(k).faults for k in twin.numbers] == [twin.scenario(k).faults for k in twin.numbers]
    more = [driven.scenario(k).faults[0] for k in driven.numbers[30:]]
    assert {name: more.count(name) for name in ONLY_DRIVES} == dict.fromkeys(ONLY_DRIVES, 2)
    assert "--through udp" in driven.scenario(0).command
    with pytest.raises(ConfigError, match="Faults: F01"):
        Campaign(replay="3:F12 lost").replayed()
    assert Campaign(replay="3:F12 lost", through="udp").replayed().faults == ("F12 lost",)


def test_the_twin_has_no_bench():
    with pytest.raises(RigError, match="through a driver"):
        TwinPlant.at_bench(object.__new__(TwinPlant), "cut")


@pytest.mark.parametrize(("tick", "found", "missed"), [(101, 2.0, ()), (102, 4.0, ("F12",))])
def test_budgets_are_milliseconds_whatever_the_period_is(tick: int, found: float, missed: tuple[str, ...]):
    since = {state: tick for state in SafeState if state > SafeState.NONE}
    course = ScenarioLog(ticks=1000, period_ms=2, stopped_tick=tick, reason=StopReason.DRIVE_FAULT, since=since)
    verdict = _verdict(Scenario(0, 0, ("F12",)), course, {"F12": 100}, {"F12": 100.0}, True)
    assert (verdict.found["F12"], verdict.missed) == (found, missed)
    assert verdict.quiet_s == pytest.approx(0.2)


def test_the_hand_of_a_tick_is_the_fastest_of_the_steps_in_it_and_the_rest_is_of_its_end():
    def sight(k: int) -> TruthSample:
        return TruthSample(np.full(2, float(k)), np.zeros(2), 1.0 if k == 3 else 0.0, are_braking=False)

    sights = by_tick([sight(k) for k in range(9)], 2)
    assert [one.q[0] for one in sights] == [2.0, 4.0, 6.0, 8.0]
    assert [one.hand_m_s for one in sights] == [0.0, 1.0, 0.0, 0.0]


def test_drives_that_brake_count_from_the_moment_after_the_onset():
    watch = TruthWatch(2)
    still = np.zeros(2)
    braking = [TruthSample(still, still, 0.0, k != 3) for k in range(6)]
    for tick in range(6):
        watch.pushed(is_so=False)
        watch.commanded(tick, still, SafeState.NONE, None)
    watch.course.ticks = 6
    assert watch.finish(Judgement({}, np.zeros(6)), braking).braked_tick == 4


def test_a_process_that_has_ended_is_an_error_in_one_line():
    ours, theirs = get_context("spawn").Pipe()
    theirs.close()
    line = driven.DriverLine(ours)
    with pytest.raises(RigError, match="has ended"):
        line.answer()


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Person whom the software knows perfectly."""
    laboratory = draw_laboratory("recupera_like", None, 2, SEED)
    prepared = ideal_knowledge(laboratory, WARM_S)
    of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    path = tmp_path_factory.mktemp("known") / "person.pickle"
    strangers = np.array([arm_of(draw_laboratory("recupera_like", None, 2, SEED + 1), prepared)])
    path.write_bytes(pickle.dumps((laboratory, prepared, of_person, strangers)))
    return path


@pytest.fixture(scope="module", params=BUSES)
def flown(request: pytest.FixtureRequest, known: Path) -> Iterator[Any]:
    with driven_ground(request.param, known) as (who, ground):
        yield lambda number, *faults: fly(who, Scenario(SEED, number, faults), ground)


FOUND = ("F01", "F02", "F12", "F12 lost", "F12 replug", "F12 hot", "F13", "F16", "F17", "F39")


@pytest.mark.slow
@pytest.mark.parametrize("name", FOUND)
def test_a_fault_is_found_through_the_driver_within_the_budget_that_it_has_on_the_twin(flown: Any, name: str):
    verdict = flown(1, name)
    assert verdict.course.crashed is None
    assert verdict.found[name] is not None
    assert not is_bad(verdict)


@pytest.mark.slow
def test_a_fault_of_nothing_is_not_found(flown: Any, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(DrivePlant, "at_bench", lambda *_: None)
    verdict = flown(1, "F12")
    assert verdict.found["F12"] is None
    assert verdict.missed == ("F12",)


@pytest.mark.slow
def test_the_same_number_is_the_same_flight_again(flown: Any):
    first, again = flown(2, "F12 lost"), flown(2, "F12 lost")
    assert first.course == again.course
