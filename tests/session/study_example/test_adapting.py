"""What is learned belongs to what the arm felt like."""

import numpy as np
import pytest

from exograv.session.study_example.adapting import Adaptation, Rates

STEADY = Rates(felt_sd=0.0)


def person(rates: Rates = STEADY, seed: int = 1001) -> Adaptation:
    return Adaptation(rates, np.random.default_rng(seed))


def trained(windows: int, level: float, rates: Rates = STEADY) -> Adaptation:
    one = person(rates)
    for _ in range(windows):
        one.window(level)
        for _ in range(8):
            one.touched(level)
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
        one.touched(0.0)
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
        one = trained(31, 0.0, Rates(felt_sd=0.0, width=width))
        one.window(at)
        return 1.0 - one.expected

    wider = trained(31, 0.0, Rates(felt_sd=0.0, width=2.0 * width))
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
