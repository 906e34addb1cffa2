"""Hidden torque of tissue is separated from weight, stiffness and damping, and is not published."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from exograv.identification import methods
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.sample_pace import BATCH_PERIOD_S
from exograv.identification.core.setting import Setting
from exograv.identification.core.tissue import (
    LATE_TIMES_S,
    RELAX_TIMES_S,
    SHAPE_FUNCTIONS,
    SHAPE_LENGTH_RAD,
    SHAPE_RAD,
    Shoulder,
    Springs,
    TissueModel,
)

STIFFNESS, OFFSET, DAMPING, FAST = 1.5, 0.4, 0.3, 0.5
TRUTH = np.array([STIFFNESS, OFFSET, DAMPING])
MEAN, SD = np.array([1.8, 0.0, 0.6]), np.array([1.2, 1.0, 0.35])
DT = 0.001
YIELDS_S = 1.0
"""Time constant of the simulated tissue, which is none of the model's."""


class Joint:
    """Elastic joint with stiffness, spring offset and damping."""

    n_joints, n_parameters = 1, 3

    def __init__(self) -> None:
        self.angle = np.zeros(1)

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.angle = sample.q
        derivative = np.array([[sample.q[0], -1.0, sample.v[0]]])
        return derivative @ x, derivative

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(1)


def sample(t: float, q: float, v: float = 0.0) -> Sample:
    return Sample(t, np.array([q]), np.array([v]), np.zeros(1), np.zeros(1))


def springs(shoulders: tuple[Shoulder, ...] = ()) -> Springs:
    return Springs(slice(0, 1), slice(1, 2), lambda model: cast(Joint, model).angle, MEAN[:1], np.zeros(1), shoulders)


def tissue() -> TissueModel:
    return TissueModel(Joint(), springs())


def hidden_torque(model: TissueModel, one: Sample, entry: int) -> float:
    """Torque of one hidden parameter of size 1."""
    x = np.zeros(model.n_parameters)
    x[3 + entry] = 1.0
    return float(model.linearise(one, x)[0][0])


@pytest.mark.parametrize("entry", range(len(RELAX_TIMES_S)))
def test_after_a_step_a_decaying_part_is_there_and_fades_by_e_in_its_time(entry: int):
    model = tissue()
    assert hidden_torque(model, sample(0.0, 0.0), entry) == 0.0
    steps = round(RELAX_TIMES_S[entry] / DT)
    torques = [hidden_torque(model, sample(k * DT, 0.5), entry) for k in range(1, steps + 1)]
    assert torques[0] == pytest.approx(0.5, rel=0.01)
    assert torques[-1] == pytest.approx(0.5 / np.e, rel=0.01)


def test_a_slow_motion_feels_a_decaying_part_as_damping_of_stiffness_times_its_time():
    model, v = tissue(), 0.02
    torques = [hidden_torque(model, sample(t, v * t, v), 0) for t in np.arange(0.0, 10.0 * RELAX_TIMES_S[0], DT)]
    assert torques[-1] == pytest.approx(RELAX_TIMES_S[0] * v, rel=0.01)


def test_after_a_pause_the_tissue_has_relaxed():
    model = tissue()
    hidden_torque(model, sample(0.0, 0.0), 0)
    assert hidden_torque(model, sample(0.1, 0.5), 0) > 0.0
    model.restart()
    assert hidden_torque(model, sample(0.2, 0.9), 0) == 0.0


def test_the_derivative_is_that_of_the_torque():
    one, other = tissue(), tissue()
    generator = np.random.default_rng(1)
    x, step = generator.normal(size=one.n_parameters), generator.normal(size=one.n_parameters)
    for t in np.arange(0.0, 2.0, BATCH_PERIOD_S):
        tau, derivative = one.linearise(sample(t, np.sin(3 * t), 3 * np.cos(3 * t)), x)
        ahead, _ = other.linearise(sample(t, np.sin(3 * t), 3 * np.cos(3 * t)), x + step)
        np.testing.assert_allclose(ahead, tau + derivative @ step, atol=1e-12)


def curve_functions(angle: float) -> np.ndarray:
    first = len(RELAX_TIMES_S)
    model = tissue()
    return np.array([hidden_torque(model, sample(0.0, angle), first + k) for k in range(SHAPE_FUNCTIONS)])


def test_curves_of_the_prior_are_of_the_stated_size_and_smooth_over_the_stated_angle():
    hidden, first = tissue().hidden, len(RELAX_TIMES_S)
    sd = hidden.sd[first : first + SHAPE_FUNCTIONS]
    at = {angle: sd * curve_functions(angle) for angle in (-1.0, 0.0, 1.0, SHAPE_LENGTH_RAD)}
    for angle in (-1.0, 0.0, 1.0):
        assert np.linalg.norm(at[angle]) == pytest.approx(SHAPE_RAD * MEAN[0], rel=0.05)
    correlation = at[0.0] @ at[SHAPE_LENGTH_RAD] / (SHAPE_RAD * MEAN[0]) ** 2
    assert correlation == pytest.approx(np.exp(-0.5), abs=0.05)


class TwoSprings(Joint):
    """Shoulder with four freedoms and a torque at each."""

    n_joints, n_parameters = 4, 11

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.angle = sample.q
        derivative = np.hstack([np.diag(sample.q), -np.eye(4), np.ones((4, 3))])
        return derivative @ x, derivative


def shoulder_model() -> TissueModel:
    usual, shoulder = np.array([1.8, 1.8, 1.8, 1.0]), Shoulder(slice(0, 4), slice(8, 11))
    where = Springs(slice(0, 4), slice(4, 8), springs().angles, usual, np.zeros(4), (shoulder,))
    return TissueModel(TwoSprings(), where)


def still(q: list[float], t: float = 0.0) -> Sample:
    return Sample(t, np.array(q), np.zeros(4), np.zeros(4), np.zeros(4))


def test_coupled_freedoms_store_energy_so_that_each_pushes_the_other_alike():
    model = shoulder_model()
    start = model.n_parameters - len(model.hidden.sd) + 4 * len(RELAX_TIMES_S) + 4 * SHAPE_FUNCTIONS
    coupling = slice(start, start + 6)
    effect = np.array([model.linearise(still(q), np.zeros(model.n_parameters))[1] for q in np.eye(4).tolist()])
    for k in range(6):
        stiffness = effect[:, :, coupling][:, :, k]
        np.testing.assert_array_equal(stiffness, stiffness.T)
        assert np.trace(stiffness) == 0.0
        assert stiffness.any()


def test_a_late_shoulder_pushes_while_the_arm_moves_and_not_at_rest():
    model = shoulder_model()
    late = slice(model.n_parameters - 3 * len(LATE_TIMES_S), model.n_parameters)

    def effect(q: list[float], t: float) -> np.ndarray:
        return model.linearise(still(q, t), np.zeros(model.n_parameters))[1][0, late]

    effect([0.5, 0.0, 0.0, 1.0], 0.0)
    moving = [effect([0.5 + 0.4 * t, 0.0, 0.0, 1.0], t) for t in np.arange(0.05, 4.0, 0.05)][-1]
    np.testing.assert_allclose(moving.reshape(-1, 3).T, np.tile(-0.4 * np.array(LATE_TIMES_S), (3, 1)), rtol=0.02)
    resting = [effect([2.1, 0.0, 0.0, 1.0], t) for t in np.arange(4.0, 9.0, 0.05)][-1]
    np.testing.assert_allclose(resting, 0.0, atol=1e-4)


def yielding_stream(seed: int) -> list[Sample]:
    """Samples of a joint with relaxing tissue, simulated independently: a memory of the angle in steps of 1 ms."""
    generator, relaxed, samples = np.random.default_rng(seed), 0.0, []
    for k in range(round(60.0 / DT)):
        t = k * DT
        q, v = 0.6 * np.sin(1.1 * t) + 0.3 * np.sin(2.9 * t), 0.66 * np.cos(1.1 * t) + 0.87 * np.cos(2.9 * t)
        relaxed += DT / YIELDS_S * (q - relaxed)
        if k % round(BATCH_PERIOD_S / DT) == 0:
            one = sample(t, q, v)
            one.tau = Joint().linearise(one, TRUTH)[0] + FAST * (q - relaxed) + generator.normal(0.0, 0.02, 1)
            samples.append(one)
    return samples


def learned(samples: list[Sample], where: Springs | None) -> tuple[np.ndarray, np.ndarray]:
    noise = Noise(np.array([0.02]), np.zeros(1), np.array([0.01]))
    all_of_it, none_of_it = np.ones(3, dtype=bool), np.zeros(3, dtype=bool)
    setting = Setting(Joint(), MEAN, np.diag(SD**2), noise, (), all_of_it, none_of_it, springs=where)
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
    samples = yielding_stream(seed)
    x, sd = learned(samples, springs())
    assert (np.abs(x - TRUTH) < 3 * sd).all()
    assert abs(x[0] - STIFFNESS) < 0.1
    x, sd = learned(samples, None)
    assert x[0] - STIFFNESS > 5 * sd[0]
    assert x[2] - DAMPING > 5 * sd[2]


def test_an_end_stop_makes_a_sample_less_certain_and_adds_no_torque():
    """Ranges and curves differ from person to person: the shape is not learned."""
    plain = tissue()
    ended = TissueModel(Joint(), replace(springs(), end_stops=lambda model: np.exp(cast(Joint, model).angle)))
    x = np.append(TRUTH, np.ones(len(plain.hidden.sd)))
    for angle in (-3.0, 0.0, 1.0):
        tau, H = ended.linearise(sample(0.0, angle), x)
        of_plain = plain.linearise(sample(0.0, angle), x)
        assert (tau == of_plain[0]).all()
        assert (of_plain[1] == H).all()
        assert ended.direction_uncertainty(np.zeros(1)) == pytest.approx(np.exp(angle))
        assert (plain.direction_uncertainty(np.zeros(1)) == 0.0).all()
