"""The fault table is complete, a number determines its scenario, and the oracle detects forbidden torques."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exograv.campaigns.faults import machine_faults as of_machine
from exograv.campaigns.faults.campaign import Campaign, run_campaign
from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.oracle import EnvelopeOracle, carrying
from exograv.campaigns.faults.scenario import Scenario
from exograv.errors import ConfigError
from exograv.safety.guard import SafeState
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from exograv.signals import Command, JointState, TorqueSource

DT = 0.001
LIMITS = Limits(np.array([30.0, 20.0]), np.array([10.0, 4.0]))
BEYOND_NM = 1.0  # Friction and the table's error.
CARRIED_NM = 8.0


def person() -> PersonLimits:
    """Limits of a person: joint 0 carries 8 N·m in every posture, joint 1 nothing."""
    constant = np.zeros((2, Features(2, 2).count))
    constant[0, 0] = CARRIED_NM
    chain = LimbTable((0, 1), 2, np.zeros_like(constant), constant)
    table = PlausibleTable((chain,), np.full(2, 0.5), np.full(2, 0.5), np.zeros(2))
    return PersonLimits(table, np.array([8.0, 4.0]), np.full(2, -2.0), np.full(2, 2.0))


def judged(torques: list[list[float]]) -> list[str | None]:
    oracle = EnvelopeOracle(LIMITS, person(), DT)
    for tau in torques:
        oracle.note(np.array(tau), np.zeros(2), frozenset(), 0.0)
    wrong = oracle.judge().wrong
    return [wrong.get(k) for k in range(len(torques))]


def test_what_carries_and_a_little_more_may_go_out():
    most = 1.3 * CARRIED_NM + 3.0 + BEYOND_NM
    assert judged([[most, 4.0], [most, 4.0]]) == [None, None]


@pytest.mark.parametrize(
    ("torques", "words"),
    [
        ([[0.0, np.nan]], "not finite"),
        ([[31.0, 0.0]], "drives' limit"),
        ([[0.0, 0.0], [0.16, 0.0]], "a step"),
        ([[14.5, 0.0], [14.5, 0.0]], "joint 0"),
        ([[0.0, -4.2], [0.0, -4.2]], "joint 1"),
        ([[15.0, 0.0], [14.9, 0.0]], "joint 0"),
    ],
)
def test_what_must_never_go_out_is_seen(torques: list[list[float]], words: str):
    assert words in (judged(torques)[-1] or "")


def test_a_torque_beyond_the_bounds_may_only_come_back_as_fast_as_it_can():
    assert judged([[15.0, 0.0], [14.85, 0.0], [14.70, 0.0]])[1:] == [None, None]


def test_the_oracle_reads_the_same_table_as_the_guard_without_its_code():
    generator = np.random.default_rng(0)
    size = (3, Features(3, 2).count)
    potential = generator.normal(size=(2, Features(3, 3, 3).count))
    chain = LimbTable((0, 2, 1), 2, generator.normal(size=size), generator.normal(size=size), 3, potential)
    table = PlausibleTable((chain,), np.zeros(3), np.zeros(3), np.zeros(3))
    q, level = generator.uniform(-3.0, 3.0, (20, 3)), generator.uniform(0.0, 1.8, 20)
    of_guard = [table.torque(one, at) for one, at in zip(q, level, strict=True)]
    assert carrying(table, q, level) == pytest.approx(np.array(of_guard), abs=1e-12)


def heavy_at_zero() -> PersonLimits:
    """Limits of a person: joint 0 carries 20 N·m times the cosine of its position."""
    weight = np.zeros((2, Features(2, 2).count))
    weight[0, 1] = 20.0
    table = PlausibleTable((LimbTable((0, 1), 2, np.zeros_like(weight), weight),), *[np.zeros(2)] * 3)
    return PersonLimits(table, np.array([8.0, 4.0]), np.full(2, -2.0), np.full(2, 2.0))


def test_a_joint_that_is_not_believed_any_more_stays_where_it_was_for_the_oracle():
    for isolated, is_wrong in ((frozenset({0}), False), (frozenset[int](), True)):
        oracle = EnvelopeOracle(LIMITS, heavy_at_zero(), DT)
        for q in (0.0, 1.5, 1.5):
            oracle.note(np.array([20.0, 0.0]), np.array([q, 0.0]), isolated, 0.0)
        assert bool(oracle.judge().wrong) == is_wrong


def test_a_joint_that_says_no_number_any_more_leaves_the_others_where_they_are_for_the_oracle():
    oracle = EnvelopeOracle(LIMITS, heavy_at_zero(), DT)
    oracle.note(np.array([20.0, 0.0]), np.zeros(2), frozenset(), 0.0)
    for _ in range(2):
        oracle.note(np.array([20.0, 0.0]), np.array([1.5, np.nan]), frozenset({1}), 0.0)
    assert list(oracle.judge().wrong) == [1, 2]


def test_every_fault_has_a_sentence_and_one_that_is_to_be_found_has_a_budget_and_a_safe_state():
    assert len({fault.id.split()[0] for fault in FAULTS.values()} - {"control"}) >= 20
    for fault in FAULTS.values():
        assert len(fault.what) > 10
        if fault.reasons:
            assert fault.budget_ms is not None
            assert fault.safe_state >= SafeState.DESCENT


@pytest.mark.parametrize("seed", range(6))
def test_a_biased_sensor_is_off_by_newton_metres_and_another_torque_constant_is_not_seen_in_the_current(seed: int):
    gain, told = np.array([2.0, 0.5]), np.array([4.0, 3.0])
    command = Command(0.0, 0, 0.005, told, told / gain)
    answer = JointState(0.0, 0, np.zeros(2), told / gain, np.full(2, np.nan), TorqueSource.CURRENT)
    bias = of_machine.CurrentBias(np.random.default_rng(seed), 2, 0)
    assert bias.measured(answer, 0) is answer
    assert bias.commanded(command, 0) is command
    off = np.abs(gain * bias.measured(answer, 1).current - told)
    assert 2.5 <= off[bias.joint] <= 6.0
    assert off.sum() == off[bias.joint]
    constant = of_machine.TorqueConstant(np.random.default_rng(seed), 2, 0)
    flowing = constant.commanded(command, 0).current
    assert flowing[constant.joint] == constant.factor * command.current[constant.joint]
    np.testing.assert_allclose(constant.measured(answer._replace(current=flowing), 0).current, command.current)


def test_a_scenario_is_its_number_and_singles_go_through_the_whole_table():
    drawn = [Scenario.drawn(3, number) for number in range(300)]
    assert drawn == [Scenario.drawn(3, number) for number in range(300)]
    singles = {scenario.faults[0] for scenario in drawn if len(scenario.faults) == 1}
    assert singles == set(FAULTS)
    assert 0.15 < np.mean([len(scenario.faults) > 1 for scenario in drawn]) < 0.45


def test_what_a_campaign_prints_replays_the_same_scenario():
    scenario = Scenario.drawn(5, 17)
    text = scenario.command.split("--replay ")[1].strip("'")
    assert Campaign(seed=5, replay=text).replayed() == scenario


def test_a_line_that_replays_says_the_level_and_the_persons_where_they_are_not_the_usual_ones():
    campaign = Campaign(seed=5, level=3, persons=4)
    assert Scenario.drawn(5, 17, campaign.told).command.startswith(
        "exograv dev faults --seed 5 --level 3 --persons 4 --r"
    )
    assert Campaign(seed=5).told == ""


@pytest.mark.parametrize(
    "options",
    [
        {"scenarios": 0},
        {"seed": -1},
        {"level": 5},
        {"persons": 0},
        {"strikes": -1},
        {"strikes": 1000},
        {"processes": 0},
    ],
)
def test_options_that_mean_nothing_are_refused(options: dict):
    with pytest.raises(ConfigError, match="allowed"):
        Campaign(**options)


def test_chosen_faults_fly_alone_and_each_meets_every_participant():
    campaign = Campaign(seed=5, scenarios=12, persons=2, only="F09, F50,F41 board")
    flown = [campaign.scenario(number) for number in campaign.numbers]
    met = {(scenario.faults, scenario.number % 2) for scenario in flown}
    assert met == {((name,), person) for name in ("F09", "F50", "F41 board") for person in (0, 1)}
    assert len(flown) == 12
    assert campaign.identity != replace(campaign, only=None).identity


@pytest.mark.parametrize("only", ["F99", "F09,F99", "", " , "])
def test_chosen_faults_that_do_not_exist_are_refused_with_all_faults(only: str):
    with pytest.raises(ConfigError, match="F39"):
        Campaign(only=only)


@pytest.mark.parametrize("text", ["x:F01", "3:F99", "3"])
def test_a_replay_line_that_means_nothing_is_refused_with_all_faults(text: str):
    with pytest.raises(ConfigError, match="F39"):
        Campaign(replay=text).replayed()


@pytest.mark.slow
def test_in_sixty_scenarios_nothing_leaves_the_envelope_and_every_miss_has_a_known_cause(tmp_path: Path):
    campaign = Campaign(scenarios=60, seed=7, persons=1, processes=1, strikes=0)
    result = run_campaign(campaign, lambda _text, _share: None)
    assert result.envelope_violations == 0
    assert result.crashed == []
    assert result.unexplained_misses == 0, result.missed
    assert result.diverged == 0
    assert result.false_trips == []
    half = replace(campaign, scenarios=30, processes=2, out=tmp_path)
    run_campaign(half, lambda _text, _share: None)
    assert run_campaign(replace(half, scenarios=60, resume=True), lambda _text, _share: None) == result


def test_a_fitted_twin_needs_a_machine_and_both_are_part_of_the_campaign():
    with pytest.raises(ConfigError, match="Give its folder with --rig FOLDER"):
        Campaign(twin="fitted")
    fitted = Campaign(twin="fitted", rig="out/twin/recupera_like")
    assert fitted.identity["rig"] == "out/twin/recupera_like"
    assert "--rig out/twin/recupera_like --twin fitted" in fitted.told
    assert "rig" not in Campaign().identity
