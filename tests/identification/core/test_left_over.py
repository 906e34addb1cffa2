"""The stop rule ends a motion when it is good enough, when more would not help, or when the wearer does not relax."""

import numpy as np
import pytest

from exograv.identification.core.interface import Agreement, Estimate, Outcome
from exograv.identification.core.left_over import TARGET_NM, StopRule
from exograv.model.rig_settings import Place
from exograv.study import targets

PLACES: tuple[Place, ...] = ("shoulder", "shoulder", "elbow", "wrist")
JOINTS = ("flexion", "rotation", "elbow", "wrist")
TARGETS = np.array([TARGET_NM[place] for place in PLACES])


def estimate(t: float, rejected_share: float = 0.0) -> Estimate:
    return Estimate(t, np.zeros(1), np.eye(1), rejected_share, 1.0)


def check(least: float) -> Agreement:
    """Return a check whose joint with the largest residual has this probability."""
    return Agreement(np.array([0.5, least, 0.5, 0.5]), np.ones(4), np.ones(4), 0.0025)


def judged(ratio_at, seconds: int = 60, rejected_share: float = 0.0) -> list[Outcome]:
    """Outcomes, one per second, for a predicted left over of this multiple of the target."""
    rule = StopRule(PLACES, JOINTS)
    return [rule.judge(estimate(float(t), rejected_share), ratio_at(t) * TARGETS) for t in range(1, seconds + 1)]


def test_at_the_target_the_motion_may_stop_after_ten_seconds_and_not_before_and_is_not_called_converged():
    verdicts = judged(lambda t: 1.0, seconds=10)
    assert verdicts[9] is Outcome.UNCHECKED
    assert set(verdicts[:9]) == {Outcome.RUNNING}


@pytest.mark.parametrize("joint", range(4))
def test_one_joint_beyond_its_target_is_enough_to_go_on(joint: int):
    predicted = 0.5 * TARGETS
    predicted[joint] = 1.01 * TARGETS[joint]
    assert StopRule(PLACES, JOINTS).judge(estimate(15.0), predicted) is Outcome.RUNNING


def test_a_prediction_that_keeps_improving_runs_until_its_target():
    verdicts = judged(lambda t: 10.0 / np.sqrt(t), seconds=100)
    assert set(verdicts[:99]) == {Outcome.RUNNING}
    assert verdicts[99] is Outcome.UNCHECKED


def test_a_prediction_that_stands_still_ends_after_two_looks_ahead_and_not_before():
    verdicts = judged(lambda t: 3.0)
    assert verdicts.index(Outcome.EXHAUSTED) == 19
    assert set(verdicts[:19]) == {Outcome.RUNNING}


def test_an_improvement_of_six_percent_in_ten_seconds_is_worth_its_time_and_four_percent_is_not():
    assert Outcome.EXHAUSTED not in judged(lambda t: 5.0 * 0.94 ** (t / 10))
    assert Outcome.EXHAUSTED in judged(lambda t: 5.0 * 0.96 ** (t / 10))


def test_a_wearer_who_does_not_let_go_is_told_so_but_not_in_the_first_seconds():
    verdicts = judged(lambda t: 10.0 / np.sqrt(t), rejected_share=0.4)
    assert verdicts[9] is Outcome.RUNNING
    assert verdicts[10] is Outcome.NOT_RELAXED


@pytest.mark.parametrize("outcome", [Outcome.UNCHECKED, Outcome.EXHAUSTED, Outcome.TIME_IS_UP])
def test_only_a_final_estimate_within_its_target_that_a_check_confirms_has_converged(outcome: Outcome):
    rule, within, beyond = StopRule(PLACES, JOINTS), 0.9 * TARGETS, 1.1 * TARGETS
    assert rule.final(outcome, estimate(60.0), within, check(0.0026)) is Outcome.CONVERGED
    assert rule.final(outcome, estimate(60.0), within, check(0.0024)) is Outcome.DISAGREES
    assert rule.final(outcome, estimate(60.0), within) is Outcome.UNCHECKED
    assert rule.final(outcome, estimate(60.0), beyond, check(0.5)) in (Outcome.EXHAUSTED, Outcome.TIME_IS_UP)


def test_a_wearer_who_did_not_relax_is_not_called_converged_at_the_end():
    assert (
        StopRule(PLACES, JOINTS).final(Outcome.NOT_RELAXED, estimate(60.0), 0.5 * TARGETS, check(0.5))
        is Outcome.NOT_RELAXED
    )


def test_a_certain_belief_from_another_day_does_not_converge_in_a_short_motion():
    assert StopRule(PLACES, JOINTS).final(Outcome.TIME_IS_UP, estimate(5.0), 0.5 * TARGETS) is Outcome.TIME_IS_UP


def test_the_motion_may_stop_at_the_targets_by_which_the_truth_is_judged():
    assert targets.TARGET_NM == TARGET_NM


def test_every_outcome_is_a_sentence():
    for outcome in Outcome:
        assert outcome.value[0].isupper()
        assert outcome.value.endswith(".")
