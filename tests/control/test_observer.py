"""The observer follows an encoder without lag in steady motion, forgets its start and does not amplify its steps."""

import numpy as np
import pytest

from exograv.control.observer import Observer

DT = 1e-3
BANDWIDTH_Hz = 30.0
STEP_17_BITS = 2 * np.pi / 2**17


def estimates(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    observer = Observer(1, DT, BANDWIDTH_Hz)
    positions, velocities = [], []
    for reading in q:
        observer.update(np.array([reading]))
        positions.append(observer.q[0])
        velocities.append(observer.v[0])
    return np.array(positions), np.array(velocities)


def test_steady_motion_is_followed_without_lag():
    t = np.arange(500) * DT
    q, v = estimates(0.3 + 1.5 * t)
    assert q[-1] == pytest.approx(0.3 + 1.5 * t[-1], abs=1e-9)
    assert v[-1] == pytest.approx(1.5, abs=1e-9)


def test_the_first_reading_is_taken_whole_so_that_torque_does_not_jump():
    q, v = estimates(np.full(3, 1.2))
    np.testing.assert_array_equal(q, 1.2)
    np.testing.assert_array_equal(v, 0.0)


def test_a_wrong_velocity_is_forgotten_within_fifty_milliseconds():
    t = np.arange(51) * DT
    _, v = estimates(1.5 * t)  # the observer starts with a velocity of 0
    assert v[50] == pytest.approx(1.5, rel=0.01)


def test_accelerated_motion_is_followed_with_the_known_error():
    # A tracker of second order lags behind an acceleration by a/ω² in position.
    t = np.arange(1000) * DT
    q, _ = estimates(0.5 * 4.0 * t**2)
    assert 0.5 * 4.0 * t[-1] ** 2 - q[-1] == pytest.approx(4.0 / (2 * np.pi * BANDWIDTH_Hz) ** 2, rel=0.2)


def test_it_never_overshoots_a_step_by_more_than_critical_damping_does():
    q, _ = estimates(np.concatenate([[0.0], np.ones(400)]))
    assert q.max() < 1.2
    assert q[-1] == pytest.approx(1.0, abs=1e-9)


def test_noise_reaches_the_velocity_as_kalata_predicts():
    # Kalata 1984, IEEE T-AES 20:174: σ_v²/σ_q² = 2β² / (dt² α (4 − 2α − β)).
    pole = np.exp(-2 * np.pi * BANDWIDTH_Hz * DT)
    alpha, beta = 1 - pole**2, (1 - pole) ** 2
    gain = np.sqrt(2 * beta**2 / (DT**2 * alpha * (4 - 2 * alpha - beta)))
    noise = np.random.default_rng(0).normal(0.0, 1e-4, 60_000)
    _, v = estimates(noise)
    assert v[1000:].std() == pytest.approx(gain * 1e-4, rel=0.05)
    assert gain < 45.0  # 1/s


def test_an_encoder_of_17_bits_at_rest_seems_slower_than_friction_is_returned_at():
    q = np.round(np.random.default_rng(0).normal(0.5, STEP_17_BITS, 5000) / STEP_17_BITS) * STEP_17_BITS
    _, v = estimates(q)
    assert np.abs(v[100:]).max() < 0.05


def test_joints_do_not_disturb_each_other():
    observer = Observer(2, DT)
    for k in range(100):
        observer.update(np.array([0.7, 0.01 * k]))
    assert observer.v[0] == 0.0
    assert observer.q[0] == 0.7
