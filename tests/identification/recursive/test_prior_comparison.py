"""Samples favour the prior that predicts them, and neither of two priors with the same prediction."""

import numpy as np
import pytest

from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.recursive import prior_comparison as contradiction
from exograv.identification.recursive.prior_comparison import UnexplainedTorque, log_odds

NOISE = Noise(np.array([0.1, 0.1]), np.array([0.1, 0.1]), np.array([0.3, 0.3]))
UNEXPLAINED = UnexplainedTorque(NOISE, Discrepancy(np.array([0.05, 0.05]), 0.5, 8))
T = np.arange(0.0, 10.0, 0.32)
BURST_NM, BURST_EVERY_S, BURST_S = 2.0, 5.0, 1.0
TWITCH_NM, TWITCH_EVERY = 15.0, 10  # samples per twitch
CLEAR_ODDS = 5.0  # as a logarithm: 150 to 1


class TwoLinks:
    """Torque model of two first moments, multiplied by the sines of two angles."""

    n_joints, n_parameters = 2, 2

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        Y = 9.81 * np.array([[np.sin(sample.q[0]), np.sin(sample.q.sum())], [0.0, np.sin(sample.q.sum())]])
        return Y @ x, Y

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(2)


def motion(x: np.ndarray, seed: int, bias: float = 0.3) -> list[Sample]:
    generator, model = np.random.default_rng(seed), TwoLinks()
    slow = bias * generator.standard_normal(2)
    samples = []
    for t in T:
        q = np.array([np.sin(0.7 * t), 1.0 + np.sin(1.1 * t)])
        sample = Sample(float(t), q, np.zeros(2), np.zeros(2), np.zeros(2))
        sample.tau = model.linearise(sample, x)[0] + slow + 0.1 * generator.standard_normal(2)
        samples.append(sample)
    return samples


def odds(one: tuple[np.ndarray, float], other: tuple[np.ndarray, float], samples: list[Sample]) -> float:
    first, second = ((mean, sd**2 * np.eye(2)) for mean, sd in (one, other))
    return log_odds(first, second, samples, TwoLinks(), UNEXPLAINED)


TABLE = np.array([0.8, 0.3])


@pytest.mark.parametrize("seed", range(5))
def test_the_right_persons_file_is_borne_out(seed: int):
    person = TABLE + 0.1 * np.random.default_rng(100 + seed).standard_normal(2)
    assert odds((person, 0.01), (TABLE, 0.1), motion(person, seed)) > 0.0


@pytest.mark.parametrize("seed", range(5))
def test_somebody_elses_file_is_contradicted(seed: int):
    off = np.array([0.12, -0.1])
    assert odds((TABLE - off, 0.01), (TABLE, 0.1), motion(TABLE + off, seed)) < -CLEAR_ODDS


def test_equal_beliefs_are_equally_likely():
    assert odds((TABLE, 0.1), (TABLE.copy(), 0.1), motion(TABLE, 0)) == 0.0


def test_a_wearer_who_pushes_is_not_taken_for_another():
    assert odds((TABLE, 0.02), (TABLE, 0.1), motion(TABLE, 3, bias=1.0)) > -CLEAR_ODDS


@pytest.mark.parametrize("seed", range(3))
def test_bursts_do_not_hide_somebody_else(seed: int):
    off = np.array([0.12, -0.1])
    samples = motion(TABLE + off, seed)
    for sample in samples:
        sample.tau = sample.tau + BURST_NM * np.sin(sample.q.sum()) * (sample.t % BURST_EVERY_S < BURST_S)
    assert odds((TABLE - off, 0.01), (TABLE, 0.1), samples) < -CLEAR_ODDS


def test_twitches_speak_against_the_right_persons_file_only_where_they_are_not_held_back(monkeypatch):
    samples = motion(TABLE, 0)
    for sample in samples[::TWITCH_EVERY]:
        sample.tau = sample.tau + TWITCH_NM * np.sin(sample.q.sum())
    assert odds((TABLE, 0.01), (TABLE, 0.1), samples) > 0.0
    monkeypatch.setattr(contradiction, "REWEIGHTINGS", 0)
    assert odds((TABLE, 0.01), (TABLE, 0.1), samples) < -CLEAR_ODDS
