"""Every constant of a virtual participant is in the register once, with its origin and its range."""

from dataclasses import fields

import pytest

from exograv.errors import ConfigError
from exograv.laboratory.participant.adaptation import AdaptationRates
from exograv.laboratory.participant.habits import Habits, register, swept, with_constant
from exograv.rig.twin.behaviour.acting_wearer import Nerves


def test_no_constant_is_left_out_and_no_name_is_there_twice():
    names = [one.name for one in register()]
    own = {f.name for kind in (Habits, AdaptationRates, Nerves) for f in fields(kind)} - {"rates", "nerves"}
    assert sorted(names) == sorted(own)


@pytest.mark.parametrize("one", register(), ids=lambda one: one.name)
def test_a_constant_lies_in_its_range_and_says_where_it_comes_from(one):
    assert one.low <= one.value <= one.high
    assert one.source
    assert one.standing in ("source", "unverified", "assumed", "fitted")


def test_two_constants_alone_were_fitted():
    assert [one.name for one in register() if one.standing == "fitted"] == ["trusts_felt", "learns_aim"]


@pytest.mark.parametrize("one", swept(), ids=lambda one: one.name)
def test_changing_a_constant_changes_it_and_nothing_else(one):
    after = {c.name: c.value for c in register(with_constant(Habits(), one.name, one.high))}
    before = {c.name: c.value for c in register()} | {one.name: one.high}
    assert after == before


def test_an_unknown_constant_is_answered_with_the_known_ones():
    with pytest.raises(ConfigError, match=r"no constant 'trust'.*trusts_felt"):
        with_constant(Habits(), "trust", 1.0)
