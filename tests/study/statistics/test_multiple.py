"""Corrected p-values are never below the raw ones, and are valid for the family."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.study.statistics.findings import ParticipantValue
from exograv.study.statistics.multiple import compare_measures, family_of_sessions, holm, max_t
from exograv.study.statistics.relabelling import relabellings, two_sided

RNG = np.random.default_rng(1000)
WAYS = relabellings(4, 4, RNG)


def test_holm_multiplies_each_p_by_the_hypotheses_that_are_left_and_never_falls():
    # By hand: 4 x 0.005, 3 x 0.01, 2 x 0.03, and 1 x 0.04 raised to the value before.
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm(np.array([0.6, 0.5])) == pytest.approx([1.0, 1.0])


@given(seed=st.integers(0, 300), measures=st.integers(1, 6))
def test_max_t_lies_between_the_raw_value_and_one(seed: int, measures: int):
    values = np.random.default_rng(1000 + seed).normal(size=(measures, 8))
    raw, corrected = two_sided(values, WAYS), max_t(values, WAYS)
    assert (corrected >= raw - 1e-12).all()
    assert (corrected <= 1.0).all()


def test_one_measure_told_many_times_costs_nothing_in_max_t():
    values = np.tile(np.random.default_rng(1001).normal(size=(1, 8)), (5, 1))
    assert max_t(values, WAYS) == pytest.approx(two_sided(values, WAYS))


def test_a_false_alarm_in_the_family_is_as_rare_as_promised():
    # All groupings of the same people are tested: the rate is exact, not simulated.
    values = np.random.default_rng(1002).normal(size=(4, 8))
    alarms = [
        max_t(np.hstack([values[:, label], values[:, ~label]]), WAYS).min() <= 0.1 + 1e-12 for label in WAYS.in_first
    ]
    assert 0.0 < np.mean(alarms) <= 0.1


def test_measures_that_cannot_be_tested_are_named():
    values = pd.DataFrame(np.random.default_rng(1003).normal(size=(8, 3)), columns=["a", "b", "c"])
    values.loc[2, "b"] = np.nan
    values["c"] = 1.0
    family = compare_measures(values, WAYS, "Pointing")
    assert family.table["measure"].tolist() == ["a"]
    assert set(family.left_out) == {"b is missing for at least one person.", "c is the same for all people."}
    assert family.p_min == pytest.approx(2 / 70)
    assert "1 measures" in family.sentence


def test_no_measure_that_can_be_tested_is_no_crash():
    family = compare_measures(pd.DataFrame({"a": np.full(8, 1.0)}), WAYS, "Pointing")
    assert family.table.empty


def test_measures_of_sessions_become_one_value_a_person_and_millimetres_are_no_second_test():
    people = tuple(ParticipantValue(f"T{k}", "trained" if k < 4 else "untrained", 8, 1.0, 0.0) for k in range(8))
    rng = np.random.default_rng(1004)
    rows = []
    for person in people:
        for session in (1, 2):
            value = rng.normal()
            found = {"median_deviation_px": value, "median_deviation_mm": 0.25 * value, "touches_per_window": value**2}
            rows += [
                {"participant": person.participant, "protocol": "flight", "level": "session", "session": session}
                | {"measure": measure, "value": number}
                for measure, number in found.items()
            ]
    measures = pd.DataFrame([*rows, {**rows[0], "protocol": "training", "value": 1e6}])
    family = family_of_sessions(measures, people, "flight", WAYS, "Flight")
    assert family.table["measure"].tolist() == ["median_deviation_px", "touches_per_window"]
    values = np.array([row["value"] for row in rows if row["measure"] == "median_deviation_px"]).reshape(8, 2).mean(1)
    assert family.table["p"].iloc[0] == pytest.approx(two_sided(values[None], WAYS)[0])
    assert family.table["difference"].iloc[0] == pytest.approx(values[:4].mean() - values[4:].mean())
