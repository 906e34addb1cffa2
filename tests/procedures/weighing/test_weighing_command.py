"""Weigh command: options are checked before motion, and an implausible form is refused with a reason."""

import pytest

from exograv.errors import ConfigError
from exograv.laboratory.weighing_command import is_enough, run_weighing
from exograv.procedures.weighing.arm_check import RESTLESS_TEXT, SURE, ArmCheck, in_doubt_not_refused
from exograv.procedures.weighing.options import DRAWN_KG, WeighOptions
from exograv.results import json_value


@pytest.mark.parametrize("options", [{"hand_weight_kg": 2.5}, {"forearm_weight_kg": -1.0}, {"level": 5}, {"seed": -1}])
def test_what_cannot_be_weighed_is_refused(options: dict):
    with pytest.raises(ConfigError, match="allowed"):
        WeighOptions(**options)


def test_a_weight_is_drawn_where_none_is_named_and_zero_means_none():
    assert WeighOptions(seed=3).weights["hand"] in DRAWN_KG
    assert WeighOptions(hand_weight_kg=0.0).weights == {}


def test_a_form_that_no_person_fits_is_refused_before_anything_moves():
    result = run_weighing(WeighOptions(seed=1000, body_mass_kg=400.0), lambda _text, _share: None)
    assert result.refused
    assert "400" in result.why
    assert result.simulated_s == 0.0
    assert result.arm_mass_kg is None
    assert {"ci95_kg", "hand_weight_kg", "ci95_hand_kg"} <= json_value(result).keys()


def verdict(refused: bool, probability: float) -> ArmCheck:
    return ArmCheck(3.0, 0.2, 75.0, refused, "Check body mass.", probability)


DOUBTFUL, SURELY = SURE - 0.01, SURE


@pytest.mark.parametrize(
    ("refused", "probability", "wants_weights", "enough"),
    [
        (True, SURELY, True, True),
        (True, SURELY, False, True),
        (False, SURELY, False, True),
        (False, SURELY, True, False),
        (True, DOUBTFUL, True, False),
        (True, DOUBTFUL, False, False),
        (False, DOUBTFUL, False, False),
    ],
)
def test_the_first_motion_is_enough_for_a_sure_verdict_with_nothing_left_to_weigh(
    refused: bool, probability: float, wants_weights: bool, enough: bool
):
    assert is_enough(verdict(refused, probability), wants_weights) == enough


def test_of_a_restless_person_only_a_sure_form_is_refused():
    assert in_doubt_not_refused(verdict(True, SURELY), is_restless=True) == verdict(True, SURELY)
    assert in_doubt_not_refused(verdict(True, DOUBTFUL), is_restless=False) == verdict(True, DOUBTFUL)
    asked = in_doubt_not_refused(verdict(True, DOUBTFUL), is_restless=True)
    assert not asked.refused
    assert asked.why == f"{RESTLESS_TEXT} Check body mass."
