"""Decaying elasticity is separated from permanent elasticity and damping, and is not published."""

import numpy as np
import pytest

from exograv.identification import methods
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.relaxation import RELAXES_S, RelaxationModel
from exograv.identification.core.sample_pace import BATCH_PERIOD_S
from exograv.identification.core.setting import Setting, Springs

STIFFNESS, OFFSET, DAMPING, FAST = 1.5, 0.4, 0.3, 0.5
TRUTH = np.array([STIFFNESS, OFFSET, DAMPING])
MEAN, SD = np.array([1.8, 0.0, 0.6]), np.array([1.2, 1.0, 0.35])
DT = 0.001


class Joint:
    """Elastic joint with stiffness, spring offset and damping."""

    n_joints, n_parameters = 1, 3

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        derivative = np.array([[sample.q[0], -1.0, sample.v[0]]])
        return derivative @ x, derivative

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(1)


def sample(t: float, q: float, v: float = 0.0) -> Sample:
    return Sample(t, np.array([q]), np.array([v]), np.zeros(1), np.zeros(1))


def fast_torque(model: RelaxationModel, one: Sample) -> float:
    return float(model.linearise(one, np.array([0.0, 0.0, 0.0, 1.0]))[0][0])


def test_after_a_step_the_fast_torque_is_there_and_fades_by_e_in_its_time():
    model = RelaxationModel(Joint(), slice(0, 1))
    assert fast_torque(model, sample(0.0, 0.0)) == 0.0
    torques = [fast_torque(model, sample(k * DT, 0.5)) for k in range(1, round(RELAXES_S / DT) + 1)]
    assert torques[0] == pytest.approx(0.5, rel=0.01)
    assert torques[-1] == pytest.approx(0.5 / np.e, rel=0.01)


def test_a_slow_motion_feels_the_fast_part_as_damping_of_stiffness_times_its_time():
    model, v = RelaxationModel(Joint(), slice(0, 1)), 0.02
    torques = [fast_torque(model, sample(t, v * t, v)) for t in np.arange(0.0, 10.0 * RELAXES_S, DT)]
    assert torques[-1] == pytest.approx(RELAXES_S * v, rel=0.01)


def test_after_a_pause_the_tissue_has_relaxed():
    model = RelaxationModel(Joint(), slice(0, 1))
    fast_torque(model, sample(0.0, 0.0))
    assert fast_torque(model, sample(0.1, 0.5)) > 0.0
    model.restart()
    assert fast_torque(model, sample(0.2, 0.9)) == 0.0


def test_the_derivative_is_that_of_the_torque():
    x = np.array([1.0, 0.2, 0.3, 0.4])
    one, other = RelaxationModel(Joint(), slice(0, 1)), RelaxationModel(Joint(), slice(0, 1))
    for t in np.arange(0.0, 2.0, BATCH_PERIOD_S):
        tau, derivative = one.linearise(sample(t, np.sin(3 * t), 3 * np.cos(3 * t)), x)
        step = np.array([0.1, -0.2, 0.3, 0.5])
        ahead, _ = other.linearise(sample(t, np.sin(3 * t), 3 * np.cos(3 * t)), x + step)
        np.testing.assert_allclose(ahead, tau + derivative @ step, atol=1e-12)


def yielding_stream(seed: int) -> list[Sample]:
    """Samples of a joint with relaxing tissue, simulated independently: a memory of the angle in steps of 1 ms."""
    generator, relaxed, samples = np.random.default_rng(seed), 0.0, []
    for k in range(round(60.0 / DT)):
        t = k * DT
        q, v = 0.6 * np.sin(1.1 * t) + 0.3 * np.sin(2.9 * t), 0.66 * np.cos(1.1 * t) + 0.87 * np.cos(2.9 * t)
        relaxed += DT / RELAXES_S * (q - relaxed)
        if k % round(BATCH_PERIOD_S / DT) == 0:
            one = sample(t, q, v)
            one.tau = Joint().linearise(one, TRUTH)[0] + FAST * (q - relaxed) + generator.normal(0.0, 0.02, 1)
            samples.append(one)
    return samples


def learned(samples: list[Sample], springs: Springs | None) -> tuple[np.ndarray, np.ndarray]:
    noise = Noise(np.array([0.02]), np.zeros(1), np.array([0.01]))
    all_of_it, none_of_it = np.ones(3, dtype=bool), np.zeros(3, dtype=bool)
    setting = Setting(Joint(), MEAN, np.diag(SD**2), noise, (), all_of_it, none_of_it, springs=springs)
    method = methods.built("recursive", setting)
    for one in samples:
        method.update(one)
    estimate = method.estimate()
    assert estimate.x.shape == (3,)
    assert estimate.covariance is not None
    assert estimate.covariance.shape == (3, 3)
    return estimate.x, estimate.sd


@pytest.mark.parametrize("seed", range(3))
def test_stiffness_and_damping_are_found_beside_tissue_that_yields_and_only_then(seed: int):
    samples, springs = yielding_stream(seed), Springs(slice(0, 1), slice(1, 2), lambda: np.zeros(1))
    x, sd = learned(samples, springs)
    assert (np.abs(x - TRUTH) < 3 * sd).all()
    assert abs(x[0] - STIFFNESS) < 0.1
    x, sd = learned(samples, None)
    assert x[0] - STIFFNESS > 5 * sd[0]
    assert x[2] - DAMPING > 5 * sd[2]
