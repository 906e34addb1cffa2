"""The filter bank is exact Bayes: mean, covariance, evidence and considered errors equal dense Gaussian algebra."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from exograv.identification.core.square_root import FilterBank

UNKNOWNS, JOINTS, SAMPLES, CONSIDERED = 3, 2, 12, 4
CORRELATION_S = 3.0
SIZES = np.array([[0.1, 0.2], [0.5, 0.4], [2.0, 1.5]])
SAME = 1e-8  # of numbers of size 1: rounding of a few hundred operations


class Dense:
    """Reference: all samples at once as one Gaussian, for one assumed size of the disturbance."""

    def __init__(self, stream: "Stream", sd: np.ndarray):
        t = np.cumsum(stream.dt)
        process = np.exp(-np.abs(t[:, None] - t[None, :]) / CORRELATION_S)
        noise = np.diag(stream.noise_sd.ravel() ** 2)
        self.R = np.kron(process, np.diag(sd**2)) + noise
        self.H, self.y = stream.H.reshape(-1, UNKNOWNS), stream.y.ravel()
        information = np.eye(UNKNOWNS) + self.H.T @ np.linalg.solve(self.R, self.H)
        self.covariance = np.linalg.inv(information)
        self.gain = self.covariance @ self.H.T @ np.linalg.inv(self.R)
        self.mean = self.gain @ self.y
        expected = self.H @ self.H.T + self.R
        residual = self.y @ np.linalg.solve(expected, self.y)
        self.log_likelihood = -0.5 * float(residual + np.linalg.slogdet(2 * np.pi * expected)[1])


class Stream:
    """Random measurements at uneven times."""

    def __init__(self, seed: int, sd: np.ndarray = SIZES[1], samples: int = SAMPLES):
        generator = np.random.default_rng(seed)
        self.dt = generator.uniform(0.05, 1.0, samples)
        self.H = generator.standard_normal((samples, JOINTS, UNKNOWNS))
        self.noise_sd = generator.uniform(0.1, 0.5, (samples, JOINTS))
        self.errors = 0.2 * generator.standard_normal((samples, JOINTS, CONSIDERED))
        self.xi = generator.standard_normal(UNKNOWNS)
        b = sd * generator.standard_normal(JOINTS)
        self.y = np.empty((samples, JOINTS))
        for k in range(samples):
            keep = np.exp(-self.dt[k] / CORRELATION_S)
            b = keep * b + np.sqrt(1 - keep**2) * sd * generator.standard_normal(JOINTS)
            self.y[k] = self.H[k] @ self.xi + b + self.noise_sd[k] * generator.standard_normal(JOINTS)


def fed(stream: Stream, sizes: np.ndarray = SIZES, considered: int = 0) -> FilterBank:
    bank = FilterBank(UNKNOWNS, sizes, CORRELATION_S, considered)
    for k in range(len(stream.dt)):
        bank.update(
            stream.dt[k], stream.H[k], stream.y[k], stream.noise_sd[k], stream.errors[k] if considered else None
        )
    return bank


@pytest.mark.parametrize("seed", range(5))
def test_one_filter_equals_the_batch_solution(seed: int):
    stream = Stream(seed)
    bank, dense = fed(stream, SIZES[1:2]), Dense(stream, SIZES[1])
    np.testing.assert_allclose(bank.mean(), dense.mean, atol=SAME)
    np.testing.assert_allclose(bank.covariance(), dense.covariance, atol=SAME)


@pytest.mark.parametrize("seed", range(5))
def test_differences_of_the_log_likelihood_are_the_dense_ones(seed: int):
    stream = Stream(seed)
    dense = np.array([Dense(stream, size).log_likelihood for size in SIZES])
    np.testing.assert_allclose(np.diff(fed(stream).log_likelihood), np.diff(dense), atol=SAME)


@pytest.mark.parametrize("seed", range(5))
def test_the_bank_is_the_mixture_of_its_filters_by_their_evidence(seed: int):
    stream = Stream(seed)
    bank, dense = fed(stream), [Dense(stream, size) for size in SIZES]
    evidence = np.exp([d.log_likelihood - dense[0].log_likelihood for d in dense])
    weights = evidence / evidence.sum()
    mean = sum(w * d.mean for w, d in zip(weights, dense, strict=True))
    spread = [d.covariance + np.outer(d.mean - mean, d.mean - mean) for d in dense]
    np.testing.assert_allclose(bank.weights, weights, atol=SAME)
    np.testing.assert_allclose(bank.mean(), mean, atol=SAME)
    np.testing.assert_allclose(bank.covariance(), sum(w * s for w, s in zip(weights, spread, strict=True)), atol=SAME)


@pytest.mark.parametrize("seed", range(5))
def test_considered_errors_widen_the_covariance_by_what_they_do_to_the_mean_and_leave_the_mean_alone(seed: int):
    stream = Stream(seed)
    bank, dense = fed(stream, SIZES[1:2], CONSIDERED), Dense(stream, SIZES[1])
    of_all = np.array([block_diag(*errors[:, None, :]) for errors in stream.errors])
    moved = dense.gain @ of_all.reshape(-1, JOINTS * CONSIDERED)
    np.testing.assert_allclose(bank.mean(), dense.mean, atol=SAME)
    np.testing.assert_allclose(bank.covariance(), dense.covariance + moved @ moved.T, atol=SAME)


@pytest.mark.parametrize("seed", range(3))
def test_the_next_measurement_is_predicted_as_the_batch_predicts_it(seed: int):
    stream = Stream(seed)
    dense, size = Dense(stream, SIZES[1]), SIZES[1]
    H, dt = stream.H[0], 0.3
    t = np.cumsum(stream.dt)
    to_now = np.kron(np.exp(-(t[-1] + dt - t) / CORRELATION_S), np.diag(size**2))
    joint = dense.H @ dense.H.T + dense.R
    cross = H @ dense.H.T + to_now
    expected = cross @ np.linalg.solve(joint, dense.y)
    variance = H @ H.T + np.diag(size**2) - cross @ np.linalg.solve(joint, cross.T)
    mean, sd = fed(stream, SIZES[1:2]).predicted(dt, H)
    np.testing.assert_allclose(mean, expected, atol=SAME)
    np.testing.assert_allclose(sd, np.sqrt(np.diag(variance)), atol=SAME)


def test_without_a_measurement_the_unknowns_are_standard_normal_and_all_sizes_equally_likely():
    bank = FilterBank(UNKNOWNS, SIZES, CORRELATION_S)
    np.testing.assert_array_equal(bank.mean(), 0.0)
    np.testing.assert_allclose(bank.covariance(), np.eye(UNKNOWNS))
    np.testing.assert_allclose(bank.weights, 1 / 3)


@pytest.mark.parametrize("true", range(3))
def test_the_size_that_made_the_disturbance_is_chosen(true: int):
    bank = fed(Stream(0, SIZES[true], samples=300))
    assert bank.weights.argmax() == true
    assert bank.weights[true] > 0.95


def test_a_measurement_without_information_changes_nothing():
    stream = Stream(0)
    bank = fed(stream)
    mean, covariance = bank.mean(), bank.covariance()
    bank.update(0.1, np.zeros((JOINTS, UNKNOWNS)), np.zeros(JOINTS), np.full(JOINTS, 1e6))
    np.testing.assert_allclose(bank.mean(), mean, atol=SAME)
    np.testing.assert_allclose(bank.covariance(), covariance, atol=SAME)


def test_after_a_pause_the_disturbance_is_forgotten_but_the_unknowns_are_not():
    stream = Stream(0)
    bank = fed(stream)
    before = bank.covariance()
    _, sd = bank.predicted(1e3, np.zeros((JOINTS, UNKNOWNS)))
    np.testing.assert_allclose(sd, SIZES[bank.weights.argmax()], rtol=1e-6)
    np.testing.assert_array_equal(bank.covariance(), before)


def test_the_information_stays_positive_over_thousands_of_precise_samples():
    stream = Stream(0)
    bank = FilterBank(UNKNOWNS, SIZES, CORRELATION_S)
    for k in range(3000):
        bank.update(0.08, stream.H[k % SAMPLES], stream.H[k % SAMPLES] @ stream.xi, np.full(JOINTS, 1e-4))
    assert np.linalg.eigvalsh(bank.covariance()).min() > 0.0
    np.testing.assert_allclose(bank.mean(), stream.xi, atol=1e-3)


def test_dense_algebra_is_told_the_noise_of_each_joint_and_not_their_mean():
    # Check of the reference itself: a wrong order of joints and samples could agree with a wrong filter by symmetry.
    stream = Stream(0)
    R = Dense(stream, np.zeros(JOINTS)).R
    np.testing.assert_array_equal(R, block_diag(*(np.diag(sd**2) for sd in stream.noise_sd)))


@pytest.mark.parametrize("seed", range(3))
def test_many_measurements_at_once_are_the_same_as_one_after_another(seed: int):
    stream = Stream(seed, samples=130)
    one = fed(stream, considered=CONSIDERED)
    many = FilterBank(UNKNOWNS, SIZES, CORRELATION_S, CONSIDERED)
    half = len(stream.dt) // 2
    for part in (slice(None, half), slice(half, None)):
        many.update_all(stream.dt[part], stream.H[part], stream.y[part], stream.noise_sd[part], stream.errors[part])
    np.testing.assert_allclose(many.mean(), one.mean(), atol=SAME)
    np.testing.assert_allclose(many.covariance(), one.covariance(), atol=SAME)
    np.testing.assert_allclose(np.diff(many.log_likelihood), np.diff(one.log_likelihood), rtol=1e-6)


def test_known_unknowns_leave_every_ordinary_sample_its_weight_and_hold_a_burst_back():
    stream = Stream(0, samples=200)
    residual = stream.y - stream.H @ stream.xi
    residual[100] += 50.0
    gated, surprise = fed(stream).all_held_back(stream.dt, residual, stream.noise_sd)
    ordinary = np.delete(np.arange(200), [100, 101])
    assert (gated[ordinary] == stream.noise_sd[ordinary]).mean() > 0.95
    assert surprise[100] > 10.0
    assert (gated[100] > 15.0).all()
