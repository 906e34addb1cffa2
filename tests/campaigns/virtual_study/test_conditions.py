"""A condition has one name, and an unknown condition is refused before a training begins."""

import pytest

from exograv.campaigns.virtual_study.conditions import Condition, condition_of
from exograv.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "condition"),
    [
        ("dam", Condition("dam", "dam", "harmonic", 0.0, 1.0)),
        ("dam@quasi-direct", Condition("dam@quasi-direct", "dam", "quasi-direct", 0.0, 1.0)),
        ("ideal+left=.20", Condition("ideal+left=0.2", "ideal", "harmonic", 0.2, 1.0)),
        ("ideal@harmonic+left=0+friction=1.0", Condition("ideal", "ideal", "harmonic", 0.0, 1.0)),
        (
            "table@quasi-direct+left=1+friction=0",
            Condition("table@quasi-direct+left=1+friction=0", "table", "quasi-direct", 1.0, 0.0),
        ),
        ("water", Condition("water", "water", "harmonic", 0.0, 1.0)),
    ],
)
def test_a_condition_is_read_and_its_name_says_only_what_is_unusual(text: str, condition: Condition):
    assert condition_of(text) == condition
    assert condition_of(condition.name) == condition


@pytest.mark.parametrize(
    "text",
    [
        "", "damp", "DAM", "dam@hydraulic", "dam+left=1.2", "dam+left=-0.1", "dam+friction=4.5", "dam+left=nan",
        "dam+friction=2+left=0.1", "water@quasi-direct", "water+left=0", "parabolic+friction=2", "gcm+left=0.3",
    ],
)  # fmt: skip
def test_what_is_no_condition_is_refused_with_what_is_allowed(text: str):
    with pytest.raises(ConfigError, match="Allowed: one of table, gcm, gradient, dam, ideal, water, parabolic"):
        condition_of(text)
