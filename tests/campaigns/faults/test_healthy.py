"""Healthy use has quiet, lively and trembling wearers, short and long flights, and a stated bound on false trips."""

import numpy as np
import pytest

from exograv.campaigns.faults.campaign import Campaign
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.healthy import CYCLE, KINDS, HealthyUse, flights_of, rate_bound_per_hour
from exograv.campaigns.faults.oracle import EnvelopeOracle
from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict
from exograv.campaigns.faults.scenario_log import ScenarioLog
from exograv.errors import ConfigError
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable


def test_all_kinds_of_use_have_short_and_long_flights_of_all_participants():
    uses = [HealthyUse.of(number) for number in range(3 * CYCLE)]
    assert {use for use in uses if use.minutes == 60} == {HealthyUse(kind, 60) for kind in KINDS}
    assert {use.kind for use in uses if use.minutes == 3} == set(KINDS)
    long = {number % 100 for number in range(100 * CYCLE) if HealthyUse.of(number).minutes == 60}
    assert len(long) == 100


@pytest.mark.parametrize("hours", [0.1, 2.0, 75.0, 300.0])
def test_the_flights_last_at_least_the_hours_that_are_asked_for(hours: float):
    minutes = sum(HealthyUse.of(number).minutes for number in range(flights_of(hours)))
    assert hours <= minutes / 60.0 < hours + 2.0 + 1e-9


@pytest.mark.parametrize(("trips", "bound"), [(0, 2.996), (1, 4.744), (3, 7.754)])
def test_the_bound_is_the_one_of_poisson_events(trips: int, bound: float):
    """Published one-sided 95 % limits of a Poisson mean, as in any table of the distribution."""
    assert rate_bound_per_hour(trips, 100.0) == pytest.approx(bound / 100.0, rel=1e-3)


def test_a_stop_in_healthy_use_is_a_false_trip_with_the_hours_until_then():
    flights = [
        ScenarioVerdict(Scenario(0, 0, ()), ScenarioLog(ticks=3_600_000), False, {}, (), 3600.0, True),
        ScenarioVerdict(Scenario(0, 1, ()), ScenarioLog(ticks=1_800_000, stopped_tick=9), True, {}, (), 1800.0, True),
    ]
    figures = figures_of(flights)
    assert (len(figures.false_trips), figures.quiet_hours, figures.ok) == (1, 1.5, False)
    assert figures.false_trips_per_hour_at_most == pytest.approx(4.744 / 1.5, rel=1e-3)


def test_a_campaign_of_healthy_use_has_no_fault_and_its_replay_names_none():
    campaign = Campaign(seed=5, healthy_hours=2.0)
    assert all(campaign.scenario(number).faults == () for number in campaign.numbers)
    command = campaign.scenario(20).command
    assert command.endswith("--healthy-hours 2.0 --replay '20:'")
    assert Campaign(seed=5, healthy_hours=2.0, replay="20:").replayed() == campaign.scenario(20)
    for wrong in (Campaign(healthy_hours=2.0, replay="20:F01"), Campaign(replay="20:")):
        with pytest.raises(ConfigError, match="NUMBER"):
            wrong.replayed()
    assert campaign.identity != Campaign(seed=5).identity


def test_a_part_that_is_judged_after_the_oracle_forgot_the_rest_is_judged_alike():
    nothing, generator = np.zeros((2, Features(2, 2).count)), np.random.default_rng(0)
    table = PlausibleTable((LimbTable((0, 1), 2, nothing, nothing),), np.zeros(2), np.zeros(2), np.full(2, 0.5))
    person = PersonLimits(table, np.array([8.0, 4.0]), np.full(2, -2.0), np.full(2, 2.0))
    q = 0.02 * generator.standard_normal((1000, 2)).cumsum(axis=0)
    tau = np.clip(0.1 * generator.standard_normal((1000, 2)).cumsum(axis=0), -3.5, 3.5)
    whole, parts = (EnvelopeOracle(Limits(np.full(2, 30.0), np.full(2, 4.0)), person, 1e-3) for _ in range(2))
    for k in range(1000):
        whole.note(tau[k], q[k], frozenset(), 0.0)
    found: dict[int, str] = {}
    for begin in (0, 500):
        known = parts.ticks
        for k in range(begin, begin + 500):
            parts.note(tau[k], q[k], frozenset(), 0.0)
        found |= {k - known + begin: what for k, what in parts.judge().wrong.items() if k >= known}
        parts.forget(400)
    assert found == whole.judge().wrong
    assert found
