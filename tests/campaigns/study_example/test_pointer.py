"""The place where a finger lands follows from the expected gravity."""

import numpy as np
import pytest

from exograv.campaigns.study_example.arm_tables import ArmTables
from exograv.campaigns.study_example.pointer import Character, Pointer
from exograv.laboratory.participant.adaptation import AdaptationRates

QUIET = Character(
    bias_sd_deg=0.0,
    felt_sd_deg=0.0,
    motor_noise=0.0,
    level_sd=0.0,
    seen_sd_mm=0.0,
    aims=0.0,
    rates=AdaptationRates(felt_sd=0.0),
)


def tables() -> ArmTables:
    """Tables of an arm with two freedoms: one lifts the weight, the other moves aside and carries nothing."""
    slope = np.array([[0.0, 0.6], [0.6, 0.0]])
    return ArmTables(
        rest=np.zeros(2),
        touch=np.array([0.9, 0.0]),
        weight=np.array([10.0, 0.0]),
        screen_slope=slope,
        tip_slope=np.vstack([np.zeros(2), slope]),
        weights=np.linspace([2.0, 0.0], [10.0, 0.0], 25),
        exo=np.zeros((25, 3, 3)),
        arm=np.zeros((25, 4, 3)),
    )


def first(level: float, character: Character = QUIET) -> np.ndarray:
    pointer = Pointer(tables(), 1001, character)
    pointer.window(level)
    return pointer.reach()[1]


def test_without_noise_whoever_expects_what_there_is_hits_the_centre():
    np.testing.assert_allclose(first(1.0), 0.0, atol=1e-9)


def test_the_first_touch_is_too_high_without_weight_and_too_low_with_more_of_it():
    assert first(0.0)[1] > 10.0
    assert first(1.8)[1] < -10.0
    assert first(0.0)[0] == pytest.approx(0.0)


def test_an_error_is_as_large_as_torque_over_stiffness_but_for_what_is_corrected():
    own = QUIET
    expected = 1e3 * 0.6 * (1.0 - own.corrected) * 10.0 / own.stiffness[0]
    assert first(0.0)[1] == pytest.approx(expected)


def test_what_is_seen_at_the_touch_is_aimed_away():
    aiming = Character(
        bias_sd_deg=0.0, felt_sd_deg=0.0, motor_noise=0.0, level_sd=0.0, seen_sd_mm=0.0, aims=0.2,
        rates=AdaptationRates(felt_sd=0.0, fast_learns=0.0, slow_learns=0.0),
    )  # fmt: skip
    pointer = Pointer(tables(), 1001, aiming)
    pointer.window(0.0)
    up = [float(pointer.reach()[1][1]) for _ in range(3)]
    np.testing.assert_allclose(np.array(up[1:]) / up[:-1], 0.8)


def test_an_arrow_that_says_late_makes_the_next_interval_shorter():
    pointer = Pointer(tables(), 1001, Character(interval_sd=0.0))
    before = pointer.interval()
    pointer.see_arrow(before - 2.0)
    assert pointer.interval() < before
