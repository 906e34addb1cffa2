"""What the operator asks for is checked before anything moves, and an implausible form is a refusal with a reason."""

import pytest

from exograv.errors import ConfigError
from exograv.session.weighing.run import DRAWN_KG, WeighOptions, run_weighing


@pytest.mark.parametrize("options", [{"hand_weight_kg": 2.5}, {"forearm_weight_kg": -1.0}, {"level": 5}, {"seed": -1}])
def test_what_cannot_be_weighed_is_refused(options: dict):
    with pytest.raises(ConfigError, match="allowed"):
        WeighOptions(**options)


def test_a_weight_is_drawn_where_none_is_named_and_zero_means_none():
    assert WeighOptions(seed=3).weights["hand"] in DRAWN_KG
    assert WeighOptions(hand_weight_kg=0.0).weights == {}


def test_a_form_that_no_person_fits_is_refused_before_anything_moves():
    result = run_weighing(WeighOptions(seed=1000, body_mass_kg=400.0), lambda _text, _share: None)
    assert result["refused"]
    assert "400" in result["why"]
    assert result["simulated_s"] == 0.0
    assert result["arm_mass_kg"] is None
    assert {"ci95_kg", "hand_weight_kg", "ci95_hand_kg"} <= set(result)
