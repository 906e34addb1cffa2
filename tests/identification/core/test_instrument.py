"""A wearer's own torque moves the arm; rows along the requested motion keep it out of the estimate."""

from dataclasses import dataclass

import numpy as np
import pytest

from exograv.identification.core.instrument import FAR_RAD, Instrumented
from exograv.identification.core.interface import RequestedMotion, Sample, TorqueModel
from exograv.identification.core.noise import Noise
from exograv.identification.recursive.recursive import Recursive

TRUTH = np.array([0.4, 0.6, 2.0])
MEAN, SD = np.array([0.3, 0.5, 1.5]), np.array([0.2, 0.5, 1.5])
STIFFNESS, DAMPING = 20.0, 3.0  # of the weak controller
OWN_SD, CORRELATION_S = 2.0, 2.0
SEEDS = range(2)


@dataclass
class Joint:
    """Joint with inertia, damping and elasticity."""

    n_joints: int = 1
    n_parameters: int = 3

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        derivative = np.array([[sample.a[0], sample.v[0], sample.q[0]]])
        return derivative @ x, derivative

    def restart(self) -> None:
        """Do nothing: the model has no memory."""

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.array([100.0 * (abs(v[0]) < 0.01)])


def restless(seed: int, seconds: float = 40.0, dt: float = 0.02) -> list[Sample]:
    """Samples under a weak controller of a wearer who does not relax and pushes from time to time."""
    rng, samples, own, q, v = np.random.default_rng(seed), [], 0.0, 0.0, 0.0
    keeps = np.exp(-dt / CORRELATION_S)
    for t in np.arange(0.0, seconds, dt):
        asked = [np.array([0.6 * w**k * f(w * t)]) for k, (w, f) in enumerate(zip([0.6] * 3, WAVES, strict=True))]
        own = keeps * own + OWN_SD * np.sqrt(1.0 - keeps**2) * rng.standard_normal()
        expected = TRUTH @ np.ravel(asked[::-1])
        tau = expected + STIFFNESS * (asked[0][0] - q) + DAMPING * (asked[1][0] - v)
        a = (tau + own - TRUTH[1] * v - TRUTH[2] * q) / TRUTH[0]
        samples.append(
            Sample(float(t), np.array([q]), np.array([v]), np.array([a]), np.array([tau]), RequestedMotion(*asked))
        )
        v += a * dt
        q += v * dt
    return samples


WAVES = (np.sin, np.cos, lambda phase: -np.sin(phase))


def z_of_damping(model: TorqueModel, samples: list[Sample]) -> float:
    """Error of the damping in stated standard deviations."""
    method = Recursive(model, MEAN, np.diag(SD**2), Noise(np.full(1, 0.1), np.full(1, 0.1), np.full(1, 0.5)), ())
    for sample in samples:
        method.update(sample)
    method.relinearise()
    estimate = method.estimate()
    assert estimate.covariance is not None
    return float((estimate.x[1] - TRUTH[1]) / np.sqrt(estimate.covariance[1, 1]))


@pytest.fixture(scope="module")
def streams() -> list[list[Sample]]:
    return [restless(seed) for seed in SEEDS]


def test_along_the_measured_motion_a_wearers_own_torque_takes_damping_away(streams):
    assert np.mean([z_of_damping(Joint(), stream) for stream in streams]) < -1.5


def test_along_the_motion_asked_for_the_damping_is_right_and_its_interval_holds(streams):
    z = np.array([z_of_damping(Instrumented(Joint(), Joint()), stream) for stream in streams])
    assert np.abs(z).max() < 2.5
    assert abs(z.mean()) < 3.0 / np.sqrt(len(z))


def sample(q: float, v: float, asked: RequestedMotion | None) -> Sample:
    return Sample(0.0, np.array([q]), np.array([v]), np.zeros(1), np.zeros(1), asked)


def test_where_nothing_was_asked_or_the_arm_is_far_off_the_rows_are_of_the_measured_motion():
    far = RequestedMotion(np.array([0.2 + 1.1 * FAR_RAD]), np.ones(1), np.ones(1))
    for asked in (None, far):
        both = Instrumented(Joint(), Joint()).linearise(sample(0.2, 0.3, asked), TRUTH)
        alone = Joint().linearise(sample(0.2, 0.3, None), TRUTH)
        np.testing.assert_array_equal(both[0], alone[0])
        np.testing.assert_array_equal(both[1], alone[1])


def test_the_expected_torque_is_that_of_the_measured_motion_and_the_rows_are_of_the_asked_one():
    model = Instrumented(Joint(), Joint())
    tau, derivative = model.linearise(sample(0.2, 0.3, RequestedMotion(np.array([0.3]), np.ones(1), np.ones(1))), TRUTH)
    np.testing.assert_allclose(tau, TRUTH @ [0.0, 0.3, 0.2])
    np.testing.assert_allclose(derivative, [[1.0, 1.0, 0.3]])


@pytest.mark.parametrize(("v", "v_asked"), [(0.0, 0.5), (0.5, 0.0)])
def test_a_turn_of_either_motion_leaves_the_direction_of_friction_open(v: float, v_asked: float):
    model = Instrumented(Joint(), Joint())
    model.linearise(sample(0.2, v, RequestedMotion(np.array([0.2]), np.array([v_asked]), np.zeros(1))), TRUTH)
    assert model.direction_uncertainty(np.array([v]))[0] > 10.0
