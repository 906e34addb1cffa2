"""Sobol' points are those of SciPy, bit for bit, so that postures stay the same without its import."""

import numpy as np
import pytest
from scipy.stats import qmc

from exograv.sobol import DIMENSIONS_MAX, sobol_points


@pytest.mark.parametrize("dimensions", [1, 2, 4, 7, 9, DIMENSIONS_MAX])
def test_the_points_are_those_of_scipy(dimensions: int):
    expected = qmc.Sobol(dimensions, scramble=False).random_base2(12)
    assert np.array_equal(sobol_points(dimensions, 4096), expected)


@pytest.mark.parametrize("dimensions", [1, 4, 9])
def test_scrambled_points_are_those_of_scipy(dimensions: int):
    expected = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(3)).random_base2(9)
    assert np.array_equal(sobol_points(dimensions, 512, np.random.default_rng(3)), expected)


def test_a_shorter_sequence_is_the_beginning_of_a_longer_one():
    assert np.array_equal(sobol_points(4, 100), sobol_points(4, 257)[:100])
    assert sobol_points(4, 0).shape == (0, 4)
    assert sobol_points(4, 1).tolist() == [[0.0] * 4]


@pytest.mark.parametrize(("dimensions", "count"), [(0, 4), (DIMENSIONS_MAX + 1, 4), (4, 2**30 + 1)])
def test_a_sequence_that_does_not_exist_is_refused(dimensions: int, count: int):
    with pytest.raises(ValueError, match="dimensions exist"):
        sobol_points(dimensions, count)
