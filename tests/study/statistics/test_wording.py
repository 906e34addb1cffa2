"""No printed value is below the possible minimum, and no success is claimed where none could be reached."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.study.statistics.wording import p_text, verdict


def printed(text: str) -> float:
    found = re.search(r"p = ([0-9.]+)", text)
    assert found
    return float(found[1].rstrip("."))


@given(p=st.floats(1e-9, 1.0), share=st.floats(1e-3, 1.0))
def test_no_text_shows_less_than_the_smallest_possible(p: float, share: float):
    assert printed(p_text(p, p_min=share * p)) >= share * p - 1e-12


@pytest.mark.parametrize(("p", "text"), [(0.1, "0.100"), (2 / 70, "0.0286"), (2 / 924, "0.00217"), (1.0, "1.000")])
def test_p_has_three_digits_rounded_up(p: float, text: str):
    assert p_text(p, p) == f"p = {text}, the smallest possible"


def test_a_p_value_below_the_smallest_possible_is_refused_with_the_reason():
    with pytest.raises(
        ConfigError, match=r"smallest value that these people allow is 0.1\. Test participants, not touches"
    ):
        p_text(0.001, 0.1)


@given(p=st.floats(0.1, 1.0))
def test_nothing_is_claimed_where_alpha_cannot_be_reached(p: float):
    text = verdict(p, 0.1, 0.05, 3, 3)
    assert "cannot reach 0.05" in text
    assert "significant" not in text


def test_a_reached_alpha_is_said_by_what_it_means():
    assert "in 0.22 % of cases" in verdict(2 / 924, 2 / 924, 0.05, 6, 6)
