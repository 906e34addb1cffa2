"""Adaptation belongs to the felt gravity level."""

import numpy as np
import pytest

from exograv.laboratory.participant.adaptation import Adaptation, AdaptationRates

STEADY = AdaptationRates(felt_sd=0.0)


def person(rates: AdaptationRates = STEADY, seed: int = 1001) -> Adaptation:
    return Adaptation(rates, np.random.default_rng(seed))


def trained(windows: int, level: float, rates: AdaptationRates = STEADY) -> Adaptation:
    one = person(rates)
    for _ in range(windows):
        one.window(level)
        for _ in range(8):
            one.learn(one.expected - level)
    return one


def test_somebody_who_was_never_elsewhere_expects_earth_wherever_it_is():
    one = person()
    for level in (0.0, 0.4, 1.0, 1.8):
        one.window(level)
        assert one.expected == 1.0


def test_on_earth_nothing_is_learned():
    one = trained(31, 1.0)
    one.window(0.0)
    assert one.expected == pytest.approx(1.0)


def test_every_touch_brings_the_expectation_nearer_to_what_was_felt():
    one = person()
    one.window(0.0)
    before = one.expected
    for _ in range(8):
        one.learn(one.expected)
        assert 0.0 < one.expected < before + 1e-12
    assert one.expected < 0.85


def test_what_was_learned_without_weight_comes_back_there_and_hardly_on_earth():
    one = trained(31, 0.0)
    one.window(0.0)
    without_weight = one.expected
    one.window(1.0)
    assert without_weight < 0.6
    assert one.expected > 0.9


@pytest.mark.parametrize("width", [0.1, 0.3, 0.6])
def test_the_wider_the_inference_the_more_goes_over_to_another_level(width: float):
    def left(at: float) -> float:
        one = trained(31, 0.0, AdaptationRates(felt_sd=0.0, width=width))
        one.window(at)
        return 1.0 - one.expected

    wider = trained(31, 0.0, AdaptationRates(felt_sd=0.0, width=2.0 * width))
    wider.window(1.0)
    assert 1.0 - wider.expected > left(1.0)
    assert left(0.0) > left(0.5) > left(1.0)


def test_a_night_costs_a_share_of_it_and_never_turns_it_round():
    one = trained(31, 0.0)
    one.window(0.0)
    before = 1.0 - one.expected
    one.night()
    one.window(0.0)
    assert 1.0 - one.expected == pytest.approx(STEADY.night_keeps * before)


def known(at: float, of: float, width: float) -> float:
    """Share of an adaptation at one level that transfers to another one."""
    one = trained(31, of, AdaptationRates(felt_sd=0.0, width=width))
    one.window(of)
    there = 1.0 - one.expected
    one.window(at)
    return (1.0 - one.expected) / there


def test_with_a_narrow_inference_what_was_learned_in_one_gravity_is_worth_nothing_in_another():
    assert known(at=1.0, of=0.0, width=1e-6) == 0.0
    assert known(at=0.0, of=1.8, width=1e-6) == 0.0


def test_with_a_wide_inference_it_is_worth_everything():
    assert known(at=1.0, of=0.0, width=1e6) == pytest.approx(1.0)


def test_how_wide_the_inference_is_does_not_change_how_fast_one_level_is_learned():
    left = [trained(3, 0.0, AdaptationRates(felt_sd=0.0, width=width)).expected for width in (1e-6, 0.3, 1e6)]
    np.testing.assert_allclose(left, left[0])


def test_what_was_learned_comes_back_by_what_is_felt_and_by_no_name():
    one = trained(31, 0.0)
    one.window(0.05)
    nearly = one.expected
    one.window(0.0)
    assert nearly == pytest.approx(one.expected, abs=0.02)
