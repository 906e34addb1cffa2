"""The re-check sees an arm of another weight, gives its interval, and rests while the wearer pushes."""

import numpy as np
import pytest

from exograv.identification.core.noise import Noise
from exograv.identification.drift.arm_scale import CHECK_S, ArmScale, ScaleCheck

JOINTS, DT, UNREST = 2, 0.04, 0.3
NOISE = Noise(np.full(JOINTS, 0.07), np.full(JOINTS, 0.07), np.full(JOINTS, UNREST))
ARM, RELAXED, SMALL, LITTLE = np.array([7.0, 2.5]), np.ones(JOINTS), np.full(JOINTS, 0.2), np.full(JOINTS, 0.05)


def checks(excess: float, seconds: float, friction: np.ndarray = SMALL, scale: np.ndarray = RELAXED, seed: int = 0):
    """Results of the checks in this time, of an arm that is heavier than its file by the share `excess`."""
    generator, keeps, found = np.random.default_rng(seed), np.exp(-DT / 3.0), list[ScaleCheck]()
    noise, check = UNREST * generator.standard_normal(JOINTS), ArmScale(NOISE)
    for _ in range(round(seconds / DT)):
        noise = keeps * noise + UNREST * np.sqrt(1.0 - keeps**2) * generator.standard_normal(JOINTS)
        result = check.take(DT, noise - excess * ARM, ARM, friction, LITTLE, scale)
        found += [] if result is None else [result]
    return found


def test_the_right_file_is_not_contradicted_in_half_an_hour():
    found = checks(0.0, 1800.0)
    assert len(found) == 1800 // CHECK_S
    assert not any(one.is_contradicted for one in found)
    z = np.array([one.excess / one.sd for one in found])
    assert 0.3 < z.std() < 1.0  # the interval is not too small, and no more than three times too large


def test_each_result_is_surer_than_the_one_before_while_the_arm_stays_the_same():
    sd = [one.sd for one in checks(0.0, 4 * CHECK_S)]
    assert sd == sorted(sd, reverse=True)
    assert sd[-1] < 0.8 * sd[0]


@pytest.mark.parametrize("excess", [-0.4, 0.4])
def test_an_arm_of_another_weight_is_found_in_one_check(excess: float):
    found = [checks(excess, CHECK_S, seed=seed)[0] for seed in range(10)]
    assert np.mean([one.is_contradicted for one in found]) >= 0.9
    assert np.mean([one.excess for one in found]) == pytest.approx(excess, abs=0.07)


def test_friction_that_may_carry_the_difference_hides_it():
    assert not checks(0.4, CHECK_S, friction=np.full(JOINTS, 3.5))[0].is_contradicted


def test_there_is_no_check_while_the_wearer_pushes():
    assert checks(0.4, 60.0, scale=np.array([1.0, 3.0])) == []
