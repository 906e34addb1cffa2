"""A prior from the previous session is never wider than the table's, frees the fit, and ends as the table's."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.recursive.previous_session import ARM_NEW, carried_over, kept_part

LAYOUT = ParameterLayout(segments=2, freedoms=4, arms=1, joints=4)


@pytest.fixture(scope="module")
def table() -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(0)
    half = generator.standard_normal((LAYOUT.count, LAYOUT.count))
    return generator.standard_normal(LAYOUT.count), half @ half.T


@pytest.fixture(scope="module")
def sure(table: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Estimate with a hundredth of the table's variance, and another mean."""
    kept = kept_part(LAYOUT)
    return table[0][kept] + 0.1, 0.01 * table[1][kept, kept]


def test_a_belief_that_is_the_tables_stays_the_tables(table: tuple[np.ndarray, np.ndarray]):
    kept = kept_part(LAYOUT)
    block = np.zeros_like(table[1])
    # The fit has its own share of new variance: only parameters that are uncorrelated with it stay exactly.
    for part in (slice(0, LAYOUT.fit.start), LAYOUT.fit):
        block[part, part] = np.diag(np.diag(table[1])[part])
    mean, covariance = carried_over(LAYOUT, (table[0][kept], block[kept, kept]), (table[0], block), 1.0)
    np.testing.assert_allclose(mean, table[0])
    np.testing.assert_allclose(covariance, block, atol=1e-12)


def test_it_is_never_wider_than_the_table(table: tuple[np.ndarray, np.ndarray], sure: tuple[np.ndarray, np.ndarray]):
    for days in (0.0, 1.0, 30.0, 1000.0):
        _, covariance = carried_over(LAYOUT, sure, table, days)
        assert (np.diag(covariance) <= np.diag(table[1]) * (1 + 1e-12)).all()
        assert np.linalg.eigvalsh(covariance)[0] > -1e-9


def test_the_arm_stays_and_the_shoulder_offset_is_asked_anew(
    table: tuple[np.ndarray, np.ndarray], sure: tuple[np.ndarray, np.ndarray]
):
    mean, covariance = carried_over(LAYOUT, sure, table, 1.0)
    share = np.diag(covariance) / np.diag(table[1])
    arm, offset = slice(0, LAYOUT.fit.start), slice(LAYOUT.fit.start, LAYOUT.fit.start + 3)
    np.testing.assert_allclose(share[arm], 0.01 * (1 - ARM_NEW) + ARM_NEW)
    np.testing.assert_allclose(share[offset], 1.0)
    np.testing.assert_allclose(mean[offset], table[0][offset])
    np.testing.assert_allclose(mean[arm] - table[0][arm], 0.1 * np.sqrt(1 - ARM_NEW))


def test_friction_and_rotors_come_from_todays_calibration(
    table: tuple[np.ndarray, np.ndarray], sure: tuple[np.ndarray, np.ndarray]
):
    mean, covariance = carried_over(LAYOUT, sure, table, 1.0)
    machine = slice(LAYOUT.fit.stop, LAYOUT.count)
    np.testing.assert_array_equal(mean[machine], table[0][machine])
    np.testing.assert_array_equal(covariance[machine, machine], table[1][machine, machine])


def test_after_years_the_file_says_nothing(table: tuple[np.ndarray, np.ndarray], sure: tuple[np.ndarray, np.ndarray]):
    mean, covariance = carried_over(LAYOUT, sure, table, 3000.0)
    np.testing.assert_allclose(mean, table[0], atol=1e-6)
    kept = kept_part(LAYOUT)
    np.testing.assert_allclose(covariance[kept, kept], table[1][kept, kept], rtol=1e-6, atol=1e-6)
