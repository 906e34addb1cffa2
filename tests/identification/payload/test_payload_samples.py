"""A log becomes samples in which position, velocity, acceleration and torque belong to the same moment."""

import numpy as np

from exograv.identification.payload.payload_samples import samples_of_log
from exograv.recording import MotionLog

W = 2.0  # rad/s of the motion
FILTER_DELAY_S = 0.04
JITTER_S = 0.001
ROUNDING = 1e-4  # of a common log


def swinging(jitter_s: float = 0.0, rounding: float = 0.0) -> MotionLog:
    """Log of one swinging joint; its current is 2 A per rad/s²."""
    t = np.arange(0.0, 10.0, 0.01)
    table = np.column_stack([np.sin(W * t), W * np.cos(W * t), -2.0 * W**2 * np.sin(W * t)])
    if rounding:
        table = np.round(table / rounding) * rounding
    t = t + jitter_s * np.random.default_rng(0).uniform(-1.0, 1.0, len(t))
    q, v, current = (column[:, None] for column in table.T)
    return MotionLog(t, q, v, current, 0, (1, len(t)))


def test_every_quantity_comes_with_the_same_delay():
    for s in samples_of_log(swinging(), np.array([3.0]))[::50]:
        phase = np.arctan2(W * s.q[0], s.v[0])
        np.testing.assert_allclose(s.a[0], -(W**2) * np.sin(phase), atol=0.03)
        np.testing.assert_allclose(s.tau[0], 6.0 * s.a[0], atol=0.2)


def test_the_delay_is_the_filters():
    samples = samples_of_log(swinging(), np.array([1.0]))
    phase = np.unwrap([np.arctan2(W * s.q[0], s.v[0]) for s in samples])
    slope, offset = np.polyfit([s.t for s in samples], phase, 1)
    started = 10.0 - 0.01 - samples[-1].t  # settling of the filter, dropped from the time
    np.testing.assert_allclose(slope, W, rtol=1e-3)
    np.testing.assert_allclose(started - offset / W, FILTER_DELAY_S, atol=0.012)


def test_rounded_positions_and_jittering_times_hardly_reach_the_acceleration():
    clean, rough = (samples_of_log(log, np.array([1.0])) for log in (swinging(), swinging(JITTER_S, ROUNDING)))
    error = np.array([r.a[0] - c.a[0] for c, r in zip(clean, rough, strict=False)])
    assert np.sqrt(np.mean(error**2)) < 0.02 * W**2


def test_torque_is_current_times_gain():
    one, three = (samples_of_log(swinging(), np.array([gain]))[100].tau for gain in (1.0, 3.0))
    np.testing.assert_allclose(three, 3.0 * one)
