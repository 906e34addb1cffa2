"""The report on identifiability separates parameters that the data determined from those of the prior."""

import numpy as np
import pytest

from exograv.identification.core.identifiability import identifiability

NAMES = ("mass", "centre", "spring", "known")
PRIOR = np.diag([4.0, 0.01, 1.0, 0.0])
X = np.array([3.0, 0.2, 1.5, 7.0])


def after(rows: np.ndarray) -> np.ndarray:
    """Covariance after rows of measurements with unit noise."""
    free = slice(0, 3)
    posterior = np.zeros((4, 4))
    posterior[free, free] = np.linalg.inv(np.linalg.inv(PRIOR[free, free]) + rows[:, free].T @ rows[:, free])
    return posterior


def test_without_data_the_prior_decided_everything():
    found = identifiability(NAMES, PRIOR, after(np.zeros((1, 4))), X)
    assert found.base == ()
    assert found.by_data == ()
    assert found.by_prior == ("mass", "centre", "spring")
    assert np.isnan(found.condition)


def test_what_is_seen_alone_is_told_by_the_data_and_a_base_parameter_of_its_own():
    found = identifiability(NAMES, PRIOR, after(np.array([[0.0, 100.0, 0.0, 0.0]])), X)
    assert found.by_data == ("centre",)
    assert [list(base.weights) for base in found.base] == [["centre"]]
    assert found.base[0].value == pytest.approx(0.2)
    assert found.base[0].sd == pytest.approx(0.01, rel=0.01)


def test_two_parameters_that_are_only_seen_together_are_one_base_parameter_and_called_confused():
    found = identifiability(NAMES, PRIOR, after(50.0 * np.array([[1.0, 0.0, 2.0, 0.0]])), X)
    (base,) = found.base
    ratio = base.weights["spring"] / base.weights["mass"]
    assert ratio == pytest.approx(2.0)
    assert base.value == pytest.approx(base.weights["mass"] * 3.0 + base.weights["spring"] * 1.5)
    assert base.sd == pytest.approx(0.02 * base.weights["mass"], rel=0.02)
    ((first, second, correlation),) = found.confused
    assert {first, second} == {"mass", "spring"}
    assert correlation == pytest.approx(-1.0, abs=1e-3)


def test_another_unit_changes_neither_the_combinations_nor_the_condition():
    rows = np.random.default_rng(0).standard_normal((3, 4)) * [3.0, 40.0, 2.0, 0.0]
    scale = np.array([1000.0, 1.0, 0.01, 1.0])
    plain = identifiability(NAMES, PRIOR, after(rows), X)
    scaled = identifiability(NAMES, PRIOR * np.outer(scale, scale), after(rows) * np.outer(scale, scale), X * scale)
    assert [list(base.weights) for base in scaled.base] == [list(base.weights) for base in plain.base]
    assert scaled.left == pytest.approx(plain.left)
    assert scaled.condition == pytest.approx(plain.condition)


def test_a_known_parameter_is_not_counted_as_learned():
    found = identifiability(NAMES, PRIOR, after(np.eye(4)), X)
    assert found.learned == 3
    assert "known" not in found.left
