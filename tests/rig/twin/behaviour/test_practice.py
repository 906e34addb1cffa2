"""Practice finds the torque that a movement needs, whatever the machine adds, and reduces torque that is not needed."""

import numpy as np
import pytest

from exograv import motion
from exograv.rig.twin.behaviour.acting_wearer import ActingWearer, usual_physiology
from exograv.rig.twin.behaviour.practice import TENSION_MAX, Learner, Practice, smooth_derivatives, tensed

DT = 4e-3
BODY = usual_physiology(4)
REST, AWAY = np.deg2rad([5.0, 10.0, 20.0, 70.0]), np.deg2rad([45.0, 20.0, 35.0, 45.0])
KEPT_DEG = 1.0
"""Largest error within which a path counts as the same in a transparency test [°]."""


def there_and_back() -> motion.Trajectory:
    parts = [motion.hold(REST, 0.3, DT), motion.minimum_jerk(REST, AWAY, 0.9, DT), motion.hold(AWAY, 0.4, DT)]
    return motion.joined([*parts, motion.minimum_jerk(AWAY, REST, 0.9, DT), motion.hold(REST, 0.3, DT)])


def error_after(practice: Practice, path: motion.Trajectory, times: int, rubbing: float, weight: float) -> np.ndarray:
    """RMS error [°] of the last of some repetitions on four masses with weight and friction."""
    person = ActingWearer(BODY, DT)
    person.trusts_anticipation = True
    q, v, errors = REST.copy(), np.zeros(4), np.zeros((len(path), 4))
    for _ in range(times):
        person.want(path, practice.anticipated, 0.0)
        for k in range(len(path)):
            tau = person.step(k * DT, q, v) - weight * np.cos(q)
            moved = v + DT * tau / INERTIA
            v = np.sign(moved) * np.maximum(np.abs(moved) - DT * rubbing / INERTIA, 0.0)
            q = q + DT * v
            errors[k] = person.error
        practice.repeated(errors)
    return np.rad2deg(np.sqrt((errors**2).mean(axis=0)))


INERTIA = np.array([0.6, 0.6, 0.3, 0.3])


@pytest.mark.parametrize(("rubbing", "weight"), [(0.0, 6.0), (2.0, 6.0)])
def test_after_practice_the_path_is_kept(rubbing: float, weight: float):
    path = there_and_back()
    practice = Practice(path, BODY, np.diag(INERTIA), np.zeros_like(path.q))
    assert error_after(practice, path, 16, rubbing, weight).max() <= KEPT_DEG


def test_torque_that_is_not_missed_is_let_go():
    path = there_and_back()
    practice = Practice(path, BODY, np.diag(INERTIA), np.full_like(path.q, 2.0))
    practice.repeated(np.zeros_like(path.q))
    np.testing.assert_allclose(practice.anticipated, 2.0 * (1.0 - Learner().let_go))


def test_a_joint_that_strays_keeps_its_torque():
    path = there_and_back()
    wave = np.sin(2.0 * np.pi * np.arange(len(path)) / len(path))[:, None] * np.deg2rad([3.0, 0.0, 0.0, 0.0])
    kept = Practice(path, BODY, np.diag(INERTIA), np.full_like(path.q, 2.0), Learner(rate=0.0))
    kept.repeated(wave)
    np.testing.assert_allclose(kept.anticipated[:, 0], 2.0)
    assert (kept.anticipated[:, 1] < 2.0).all()


def test_slow_waves_are_derived_as_they_are_and_fast_ones_are_gone():
    t = np.arange(1000) * DT
    slow, fast = np.sin(np.pi * t)[:, None], np.sin(40.0 * np.pi * t)[:, None]
    q, v, a = smooth_derivatives(slow + fast, DT, 2.0)
    np.testing.assert_allclose(q, slow, atol=1e-3)
    np.testing.assert_allclose(v, np.pi * np.cos(np.pi * t)[:, None], atol=1e-2)
    np.testing.assert_allclose(a, -(np.pi**2) * slow, atol=3e-2)


def test_who_strays_stiffens_up_to_a_limit_and_eases_again():
    strays, keeps = np.full((10, 4), np.deg2rad(2.0)), np.zeros((10, 4))
    tension = np.ones(4)
    for _ in range(30):
        tension = tensed(tension, strays, np.deg2rad(0.9))
    np.testing.assert_allclose(tension, TENSION_MAX)
    for _ in range(100):
        tension = tensed(tension, keeps, np.deg2rad(0.9))
    np.testing.assert_allclose(tension, 1.0)


def test_each_joint_stiffens_for_itself():
    error = np.zeros((10, 4))
    error[:, 2] = np.deg2rad(2.0)
    assert np.argmax(tensed(np.ones(4), error, np.deg2rad(0.9))) == 2
    assert (tensed(np.ones(4), error, np.deg2rad(0.9))[[0, 1, 3]] == 1.0).all()
