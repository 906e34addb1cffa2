"""Slow torque: the batch agrees with the recursive filter, and considered unknowns only widen the covariance."""

import numpy as np
import pytest

from exograv.identification.core.square_root import FilterBank
from exograv.identification.recursive.recursive import DISTURBANCE_SCALES
from exograv.procedures.weighing.slow_torque import CORRELATION_S, RegressionRows, believed, motion_information

DT, SAMPLES, JOINTS, UNKNOWNS = 0.08, 60, 2, 3
USUAL = np.array([0.3, 0.15])
SAME = 1e-8
"""Tolerance between two orders of the same arithmetic."""


@pytest.fixture
def rows() -> RegressionRows:
    random = np.random.default_rng(1000)
    H = random.standard_normal((SAMPLES, JOINTS, UNKNOWNS))
    noise = random.uniform(0.1, 0.2, (SAMPLES, JOINTS))
    y = H @ np.array([0.5, -1.0, 0.3]) + noise * random.standard_normal((SAMPLES, JOINTS))
    return RegressionRows(DT * np.arange(SAMPLES), H, y, noise)


def prior() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(UNKNOWNS), np.ones(UNKNOWNS)


def test_a_batch_believes_what_the_recursive_filter_believes(rows):
    bank = FilterBank(UNKNOWNS, DISTURBANCE_SCALES[:, None] * USUAL, CORRELATION_S)
    for H, y, noise in zip(rows.H, rows.y, rows.noise, strict=True):
        bank.update(DT, H, y, noise)
    belief = believed(motion_information([rows], USUAL), *prior())
    np.testing.assert_allclose(belief.mean, bank.mean(), atol=SAME)
    np.testing.assert_allclose(belief.covariance, bank.covariance(), atol=SAME)


def test_evidence_is_the_probability_of_the_data(rows):
    one = motion_information([rows], USUAL)[2]
    mean, variance = np.array([0.2, -0.1, 0.4]), np.array([0.5, 2.0, 1.0])
    slow = (DISTURBANCE_SCALES[2] * USUAL) ** 2
    lag = np.abs(rows.t[:, None] - rows.t)
    blocks = [slow[j] * np.exp(-lag / CORRELATION_S) + np.diag(rows.noise[:, j] ** 2) for j in range(JOINTS)]
    H = np.concatenate([rows.H[:, j] for j in range(JOINTS)])
    whole = np.zeros((JOINTS * SAMPLES, JOINTS * SAMPLES))
    whole[:SAMPLES, :SAMPLES], whole[SAMPLES:, SAMPLES:] = blocks
    off, spread = rows.y.T.ravel() - H @ mean, whole + (H * variance) @ H.T
    expected = -0.5 * off @ np.linalg.solve(spread, off) - 0.5 * np.linalg.slogdet(spread)[1]
    assert believed([one], mean, variance).log_evidence == pytest.approx(expected, abs=1e-6)


def test_motions_apart_say_more_than_one_of_them(rows):
    one, two = (believed(motion_information([rows] * count, USUAL), *prior()) for count in (1, 2))
    assert np.all(np.diag(two.covariance) < np.diag(one.covariance))


def test_what_is_considered_widens_the_others_and_is_not_learned(rows):
    information = motion_information([rows], USUAL)
    free = believed(
        [type(one)(one.matrix[:2, :2], one.vector[:2], one.constant) for one in information], np.zeros(2), np.ones(2)
    )
    considered = believed(information, np.zeros(3), np.ones(3), considered=1)
    np.testing.assert_allclose(considered.mean, [*free.mean, 0.0], atol=SAME)
    assert np.all(np.diag(considered.covariance)[:2] > np.diag(free.covariance))
    assert considered.covariance[2, 2] == 1.0


def test_a_burst_hardly_moves_what_is_believed(rows):
    calm = believed(motion_information([rows], USUAL), *prior()).mean
    rows.y[30:34, 0] += 5.0
    struck = believed(motion_information([rows], USUAL), *prior()).mean
    gated = believed(motion_information([rows], USUAL, calm), *prior()).mean
    assert np.abs(gated - calm).max() < 0.3 * np.abs(struck - calm).max()
