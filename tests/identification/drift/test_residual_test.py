"""A lasting residual torque is found in a predictable time; noise, friction, stops and lively wearers give no alarm."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.identification.core.noise import Noise
from exograv.identification.drift.residual_test import Bound, ResidualTest, difference_share

JOINTS, DT, UNREST = 2, 0.04, 0.3
NOISE = Noise(np.full(JOINTS, 0.07), np.full(JOINTS, 0.07), np.full(JOINTS, UNREST))
TOLD, LARGE = Bound(np.full(JOINTS, 0.25), 3.6e5), Bound(np.full(JOINTS, 2.0), 3.6e6)
NONE, ALWAYS = np.zeros(JOINTS), np.ones((2, JOINTS), bool)
Torque = Callable[[float], np.ndarray]


def unrest(seconds: float, sd: float, seed: int = 0) -> np.ndarray:
    """Slow torque of a wearer [N·m], one row per sample."""
    generator, keeps = np.random.default_rng(seed), np.exp(-DT / NOISE.disturbance_correlation_s)
    rows = [sd * generator.standard_normal(JOINTS)]
    for _ in range(round(seconds / DT) - 1):
        rows.append(keeps * rows[-1] + sd * np.sqrt(1.0 - keeps**2) * generator.standard_normal(JOINTS))
    return np.array(rows)


def found_s(test: ResidualTest, rows: np.ndarray, level: int, friction: np.ndarray = NONE, may: np.ndarray = ALWAYS):
    """Time of the first alarm [s] and its joint; None without an alarm."""
    for k, residual in enumerate(rows):
        test.take(DT, residual, friction, NONE, may)
        if (joint := test.beyond(level)) is not None:
            return DT * (k + 1), joint
    return None


@pytest.mark.parametrize("scale", [1.0, 3.0, 6.0])
def test_ten_minutes_of_a_restless_wearer_gives_no_alarm(scale: float):
    test = ResidualTest(NOISE, (TOLD, LARGE))
    assert found_s(test, unrest(600.0, scale * UNREST), level=0) is None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_residual_is_found_at_its_joint_with_its_size_and_sooner_the_larger_it_is(sign: float):
    times = []
    for size in (1.0, 2.0, 4.0):
        test = ResidualTest(NOISE, (TOLD, LARGE))
        rows = unrest(120.0, UNREST, seed=1)
        rows[:, 1] += sign * size
        found = found_s(test, rows, level=0)
        assert found is not None
        times.append(found[0])
        assert found[1] == 1
        assert test.mean(1) == pytest.approx(sign * size, abs=3.0 * UNREST)
    assert times == sorted(times, reverse=True)
    assert times[0] < 60.0
    assert times[-1] < 10.0


def test_a_residual_within_friction_is_no_finding():
    rows = unrest(200.0, UNREST) + 2.5
    assert found_s(ResidualTest(NOISE, (TOLD, LARGE)), rows, 0, friction=np.full(JOINTS, 3.0)) is None
    assert found_s(ResidualTest(NOISE, (TOLD, LARGE)), rows, 0) is not None


def test_a_torque_that_a_stop_may_carry_is_no_finding():
    rows, may = unrest(200.0, UNREST) + 2.0, ALWAYS.copy()
    may[0] = False
    assert found_s(ResidualTest(NOISE, (TOLD, LARGE)), rows, 0, may=may) is None


def test_a_descent_needs_a_larger_residual_than_a_message():
    rows = unrest(300.0, UNREST) + 1.2
    test = ResidualTest(NOISE, (TOLD, LARGE))
    assert found_s(test, rows, level=1) is None
    assert test.beyond(0) is not None


@pytest.mark.parametrize("level", [0, 1], ids=["message", "descent"])
@pytest.mark.parametrize("hz", [0.3, 0.5, 0.8, 2.0])
@pytest.mark.parametrize("relaxed_sd", [0.15, UNREST], ids=["elbow", "shoulder"])
def test_a_wearer_who_sways_with_six_newton_metres_from_the_start_gives_no_alarm(
    hz: float, relaxed_sd: float, level: int
):
    t = DT * np.arange(round(120.0 / DT))
    rows = unrest(120.0, relaxed_sd) + 6.0 * np.sin(2.0 * np.pi * hz * t)[:, None]
    noise = Noise(NOISE.sd, NOISE.correlation_s, np.full(JOINTS, relaxed_sd))
    share = relaxed_sd / UNREST
    bounds = tuple(Bound(share * bound.torque_Nm, bound.mean_s) for bound in (TOLD, LARGE))
    assert found_s(ResidualTest(noise, bounds), rows, level) is None


def test_the_size_of_a_slow_torque_is_estimated_from_its_changes_only():
    test = ResidualTest(NOISE, (TOLD, LARGE))
    for residual in unrest(600.0, 3.0 * UNREST) + 5.0:
        test.take(DT, residual, np.full(JOINTS, 99.0), NONE, ALWAYS)
    assert test.scale == pytest.approx(np.full(JOINTS, 3.0), rel=0.4)


def test_the_variance_of_a_difference_of_means_agrees_with_simulated_noise():
    rows = unrest(5_000.0, UNREST)
    means = rows.reshape(-1, round(1.0 / DT), JOINTS).mean(axis=1)
    share = np.diff(means, axis=0).var() / UNREST**2
    assert share == pytest.approx(difference_share(1.0 / NOISE.disturbance_correlation_s), rel=0.1)
