"""Two flights of another campaign that once ended badly: a diverged twin, and a relaxed hand at 2.31 m/s."""

from pathlib import Path

import pytest

from exograv.campaigns.faults.acceptance import HAND_MAX_M_S
from exograv.campaigns.faults.campaign import Campaign
from exograv.campaigns.faults.fault_participants import load_participant, prepare_participant
from exograv.campaigns.faults.scenario import ScenarioVerdict, fly

SEED = 6600123


def flown(replay: str, folder: Path) -> ScenarioVerdict:
    campaign = Campaign(seed=SEED, replay=replay)
    scenario = campaign.replayed()
    person = prepare_participant(SEED, scenario.number % campaign.persons, campaign.level, folder)
    return fly(load_participant(person), scenario)


@pytest.mark.slow
def test_a_push_against_an_arm_near_its_pole_ends_in_no_diverged_twin(tmp_path: Path):
    course = flown("1292:F29", tmp_path).course
    assert course.crashed is None
    assert course.violated_ticks == 0


@pytest.mark.slow
def test_a_relaxed_hand_that_once_reached_two_metres_per_second_stays_slow(tmp_path: Path):
    verdict = flown("1022:F29", tmp_path)
    assert verdict.relaxed
    assert verdict.course.flight_hand_m_s < HAND_MAX_M_S
    assert verdict.course.violated_ticks == 0
