"""Findings concern people, guarantee their intervals, and go into JSON unchanged."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.study.statistics.made_up_touches import GROUPS, made_up_touches

from exograv.errors import ConfigError
from exograv.results import json_value
from exograv.study.statistics.compare import CompareSettings, compare


def test_three_against_three_are_told_that_they_cannot_reach_alpha():
    found = compare(*made_up_touches((3, 3), log_difference=-3.0))
    assert found.primary.p == pytest.approx(0.1)
    assert found.primary.p_min == pytest.approx(0.1)
    assert found.primary.text == "p = 0.100, the smallest possible"
    assert "cannot reach 0.05" in found.primary.sentence
    assert any("At least 4 against 4 are needed" in sentence for sentence in found.limits)
    assert "significant" not in json.dumps(json_value(found))


def test_the_contract_has_the_figures_of_the_report():
    found = compare(*made_up_touches((3, 3)))
    told = json.loads(json.dumps(json_value(found.contract()), allow_nan=False))
    assert told["participants"] == {"trained": 3, "untrained": 3}
    assert told["touches"] == 240
    assert set(told["deviation_px"]) == set(GROUPS)
    assert told["deviation_px"]["trained"]["iqr"] > 0.0
    assert told["primary"]["test"] == "exact permutation"
    low, high = told["primary"]["ci95"]
    assert low < told["primary"]["effect"] < high


def test_all_of_it_is_json_without_infinities():
    text = json.dumps(json_value(compare(*made_up_touches((3, 4)))), allow_nan=False)
    assert json.loads(text)["bayes"]["posteriors"]


def test_six_against_six_find_a_large_effect_and_say_how_rare_chance_is():
    found = compare(*made_up_touches((6, 6), log_difference=-2.0))
    assert found.primary.p == pytest.approx(2 / 924)
    assert "in 0.22 % of cases" in found.primary.sentence
    assert not any("cannot reach" in sentence for sentence in found.limits)


def test_a_person_with_a_thousand_touches_weighs_no_more():
    touches, participants = made_up_touches((3, 3))
    own = touches.loc[touches["participant"] == "U2"]
    many = pd.concat([touches, *[own] * 20], ignore_index=True)
    once, often = compare(touches, participants), compare(many, participants)
    assert often.primary == once.primary
    assert often.effect.value == pytest.approx(once.effect.value)
    assert often.spread["untrained"].median == pytest.approx(once.spread["untrained"].median)


def test_scaling_every_deviation_leaves_ratio_and_p_as_they_are():
    touches, participants = made_up_touches((3, 4))
    px, mm = (compare(touches, participants, CompareSettings(unit=unit, mixed=False)) for unit in ("px", "mm"))
    assert px.effect.value == pytest.approx(mm.effect.value, rel=1e-6)
    assert px.primary == mm.primary


def test_swapping_the_groups_inverts_the_ratio():
    tables = made_up_touches((3, 4))
    one, other = (
        compare(*tables, CompareSettings(groups=pair, mixed=False)) for pair in (GROUPS, ("untrained", "trained"))
    )
    assert other.effect.value is not None
    assert one.effect.value == pytest.approx(1.0 / other.effect.value)
    assert one.primary.p == pytest.approx(other.primary.p)


@pytest.mark.parametrize("people", [(0, 3), (3, 0), (0, 0), (1, 1), (1, 3), (2, 2)])
def test_hardly_anybody_is_said_and_no_crash(people: tuple[int, int]):
    found = compare(*made_up_touches(people))
    json.dumps(json_value(found), allow_nan=False)
    if min(people) == 0:
        assert found.primary.p is None
        assert "no test is possible" in found.primary.sentence
    elif min(people) == 1:
        assert found.effect.interval is None
        assert any("there is no interval" in sentence for sentence in found.limits)


def test_a_sealed_group_is_not_compared():
    touches, participants = made_up_touches((3, 3))
    found = compare(touches, participants.assign(group=pd.Series([None] * 6, dtype="str")))
    assert found.primary.p is None
    assert sum("still sealed" in sentence for sentence in found.left_out) == 6


def test_groups_that_are_the_same_are_refused():
    with pytest.raises(ConfigError, match="give two different groups"):
        CompareSettings(groups=("trained", "trained"))
    with pytest.raises(ConfigError, match="alpha is 0"):
        replace(CompareSettings(), alpha=0.0)


def test_alike_groups_of_many_alike_people_are_said_to_be_alike():
    found = compare(*made_up_touches((30, 30), log_difference=0.0, person_sd=0.05), CompareSettings(mixed=False))
    assert any("is shown, if people's logarithms are normal" in sentence for sentence in found.limits)
    few = compare(*made_up_touches((3, 3), log_difference=0.0), CompareSettings(mixed=False))
    assert any("is not shown either" in sentence for sentence in few.limits)


def test_the_false_alarm_rate_of_the_whole_way_is_at_most_alpha():
    rng = np.random.default_rng(1000)
    alarms = 0
    for _ in range(60):
        tables = made_up_touches((4, 4), 0.0, windows=2, touches=4, seed=int(rng.integers(1000, 10**6)))
        alarms += (compare(*tables, CompareSettings(mixed=False, bayes=False)).primary.p or 1.0) <= 0.05
    # At most 2 of 70 groupings reject: more than 8 of 60 would occur once in 10 000 times.
    assert alarms <= 8
