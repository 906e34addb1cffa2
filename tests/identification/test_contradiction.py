"""Motion speaks for the belief that foretold it, and for none of two where both foretold the same."""

import numpy as np
import pytest

from exograv.identification.contradiction import Unexplained, log_evidence
from exograv.identification.discrepancy import Discrepancy
from exograv.identification.interface import Sample
from exograv.identification.recursive import Noise

NOISE = Noise(np.array([0.1, 0.1]), np.array([0.1, 0.1]), np.array([0.3, 0.3]))
UNEXPLAINED = Unexplained(NOISE, Discrepancy(np.array([0.05, 0.05]), 0.5, 8))
T = np.arange(0.0, 10.0, 0.32)
CLEAR_ODDS = 5.0  # as a logarithm: 150 to 1


class TwoLinks:
    """Two first moments, seen through the sine of two angles."""

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


def evidence(mean: np.ndarray, sd: float, samples: list[Sample]) -> float:
    return log_evidence((mean, sd**2 * np.eye(2)), samples, TwoLinks(), UNEXPLAINED)


TABLE = np.array([0.8, 0.3])


@pytest.mark.parametrize("seed", range(5))
def test_the_right_persons_file_is_borne_out(seed: int):
    person = TABLE + 0.1 * np.random.default_rng(100 + seed).standard_normal(2)
    samples = motion(person, seed)
    assert evidence(person, 0.01, samples) > evidence(TABLE, 0.1, samples)


@pytest.mark.parametrize("seed", range(5))
def test_somebody_elses_file_is_contradicted(seed: int):
    samples = motion(TABLE + np.array([0.12, -0.1]), seed)
    assert evidence(TABLE - np.array([0.12, -0.1]), 0.01, samples) < evidence(TABLE, 0.1, samples) - CLEAR_ODDS


def test_equal_beliefs_are_equally_likely():
    samples = motion(TABLE, 0)
    assert evidence(TABLE, 0.1, samples) == evidence(TABLE.copy(), 0.1, samples)


def test_a_wearer_who_pushes_is_not_taken_for_another():
    samples = motion(TABLE, 3, bias=1.0)
    assert evidence(TABLE, 0.02, samples) > evidence(TABLE, 0.1, samples) - CLEAR_ODDS
