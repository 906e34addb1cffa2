"""A code is random and reveals nothing, and a typing error in it is detected."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.study.participants.codes import DIGITS, LETTERS, SYMBOLS, draw_code, is_code, typed_code

codes = st.integers(0, 2**32).map(lambda seed: draw_code(choice=random.Random(seed).choice))


@given(codes)
def test_a_drawn_code_is_one_and_may_be_typed_in_small_letters(code: str):
    assert is_code(code)
    assert typed_code(f" {code.lower()} ") == code


@given(codes, st.integers(0, 6), st.sampled_from(SYMBOLS))
def test_one_wrong_symbol_is_seen(code: str, place: int, symbol: str):
    typed = code[:place] + symbol + code[place + 1 :]
    assert is_code(typed) == (typed == code)


@given(codes, st.integers(0, 6), st.integers(0, 6))
def test_two_swapped_symbols_are_seen(code: str, one: int, other: int):
    symbols = list(code)
    symbols[one], symbols[other] = symbols[other], symbols[one]
    typed = "".join(symbols)
    assert is_code(typed) == (typed == code)


def test_no_symbol_is_taken_for_another():
    assert not set(SYMBOLS) & set("0OQ1I2Z5S8BGU")
    assert len(SYMBOLS) == len(set(LETTERS) | set(DIGITS)) == 23


def test_what_is_no_code_is_not_repeated():
    with pytest.raises(ConfigError) as refused:
        typed_code("Hannelore")
    assert "annelore" not in str(refused.value).lower()


def test_a_code_that_is_taken_is_not_drawn():
    chance = random.Random(5)
    first = draw_code(choice=random.Random(5).choice)
    assert draw_code({first}, chance.choice) != first
