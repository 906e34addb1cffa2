"""Weight estimator: a weight is found beside an arm that is not exactly known, with a correct interval."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.support import sample_postures
from exograv.procedures.weighing.weighing_path import informative_path
from exograv.procedures.weighing.weight_estimator import WeightEstimator, WeightPasses

PATH_DT = 0.02
SHORT_PASS_KG = 0.12  # two standard deviations at the forearm, from half as long as is usual


@pytest.fixture(scope="module")
def weighed(model, believed_arm, heard):
    x, covariance = believed_arm
    postures = sample_postures(model.assembly.description, 16)[1:]

    def at(place: WeightPlace, kg: float, farther_m: float = 0.0):
        way = informative_path(model, x, held_weight(model.assembly.arm, 1.0, at=place), 0.7, postures)
        path = way.cycles(15.0, PATH_DT).table()
        # The identified arm is ten times more certain than the table, and not exactly right.
        truth = x + 0.1 * np.sqrt(np.diag(covariance)) * np.random.default_rng(1001).standard_normal(len(x))
        loaded = truth.copy()
        loaded[ParameterLayout.of(model.assembly).phi] += held_weight(
            model.assembly.arm, kg, at=place, farther_m=farther_m
        )
        passes = WeightPasses(heard(path, truth, 1002), heard(path, loaded, 1003))
        return WeightEstimator(model, x, 0.01 * covariance, place).weigh(passes)

    return at


@pytest.mark.parametrize(("place", "kg"), [("hand", 0.5), ("hand", 2.0), ("forearm", 1.0)])
def test_a_hidden_weight_lies_in_its_interval(weighed, place: WeightPlace, kg: float):
    found = weighed(place, kg)
    assert found.ci95[0] < kg < found.ci95[1]
    assert abs(found.mass - kg) < SHORT_PASS_KG


def test_no_weight_is_found_where_there_is_none(weighed):
    found = weighed("hand", 0.0)
    assert found.ci95[0] < 0.0 < found.ci95[1]


def test_a_weight_held_farther_out_seems_heavier_by_no_more_than_the_interval_allows(weighed):
    found = weighed("hand", 2.0, 0.013)
    assert found.mass > 2.0
    assert found.ci95[0] < 2.0
