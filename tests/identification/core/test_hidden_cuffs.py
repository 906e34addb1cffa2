"""Cuffs that slip are told from the arm's own parameters, and are not published."""

from typing import cast

import numpy as np
import pytest

from exograv.identification import methods
from exograv.identification.core.hidden_cuffs import (
    ALONG,
    SLIPS_AT_M,
    CuffLoads,
    CuffModel,
    Cuffs,
)
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.setting import Setting
from exograv.identification.core.tissue import Springs, TissueModel

MEAN = np.array([1.8, 0.0, 10.0])
SD = np.array([0.1, 0.1, 3.0])
STIFFNESS_N_M = 2000.0
WAY_M_RAD = 0.01
"""Strain of the simulated cuff per angle."""


class Held:
    """Joint with stiffness, spring offset and a lever weight, whose cuff is strained along the limb by its angle."""

    n_joints, n_parameters = 1, 3

    def __init__(self) -> None:
        self.angle = np.zeros(1)
        self.is_lost = False

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.angle = sample.q
        derivative = np.array([[sample.q[0], -1.0, np.sin(sample.q[0])]]) * (not self.is_lost)
        return derivative @ x, derivative

    def cuff_loads(self) -> CuffLoads:
        by_displacement, strain = np.zeros((1, 1, 3)), np.zeros((1, 3))
        by_displacement[0, 0, ALONG] = -STIFFNESS_N_M * WAY_M_RAD
        strain[0, ALONG] = WAY_M_RAD * self.angle[0]
        return CuffLoads(by_displacement, strain)

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(1)


SPRINGS = Springs(slice(0, 1), slice(1, 2), lambda model: cast(Held, model).angle, MEAN[:1], np.zeros(1))
CUFFS = Cuffs(1, lambda model: cast(Held, model).cuff_loads())


def model(arm: Held | None = None) -> CuffModel:
    arm = arm or Held()
    return CuffModel(arm, TissueModel(arm, SPRINGS), CUFFS)


def sample(t: float, q: float, tau: float = 0.0) -> Sample:
    return Sample(t, np.array([q]), np.zeros(1), np.zeros(1), np.array([tau]))


def hidden_torques(entry: int, angles: np.ndarray) -> np.ndarray:
    """Torque of one hidden parameter of the cuffs of size 1, along a motion."""
    of = model()
    x = np.zeros(of.n_parameters)
    x[of.n_parameters - len(SLIPS_AT_M) + entry] = 1.0
    return np.array([of.linearise(sample(0.1 * k, q), x)[0][0] for k, q in enumerate(angles)])


@pytest.mark.parametrize("part", range(len(SLIPS_AT_M)))
def test_a_slipping_cuff_gives_way_beyond_its_threshold_and_stays_there_on_the_way_back(part: int):
    there, threshold = 2.5 * max(SLIPS_AT_M), SLIPS_AT_M[part]
    back = there - 1.9 * threshold
    angles = np.concatenate([np.linspace(0.0, there, 50), np.linspace(there, back, 50)]) / WAY_M_RAD
    torque = hidden_torques(part, angles)
    assert torque[angles <= threshold / WAY_M_RAD][0] == 0.0
    assert torque[49] == pytest.approx(-STIFFNESS_N_M * WAY_M_RAD * (there - threshold))
    assert torque[50:] == pytest.approx(torque[49])


def test_a_restarted_motion_finds_the_cuff_where_it_was_fastened():
    of = model()
    x = np.zeros(of.n_parameters)
    x[-1] = 1.0
    assert of.linearise(sample(0.0, 3.0), x)[0][0] != 0.0
    of.restart()
    assert of.linearise(sample(0.0, 0.0), x)[0][0] == 0.0


def test_a_sample_whose_loops_are_open_moves_no_cuff():
    arm = Held()
    of = model(arm)
    ones = np.ones(of.n_parameters)
    of.linearise(sample(0.0, 0.1), ones)
    arm.is_lost = True
    tau, derivative = of.linearise(sample(0.1, 1e150), ones)
    assert not tau.any()
    assert not derivative.any()
    arm.is_lost = False
    assert not of.linearise(sample(0.2, 0.0), ones)[1][0, -len(SLIPS_AT_M) :].any()


def estimate(cuffs: Cuffs | None) -> Estimate:
    """Estimate of an arm of 10 N·m whose cuff slips, from passes both ways."""
    noise = Noise(np.array([0.02]), np.zeros(1), np.array([0.02]))
    every, none = np.ones(3, dtype=bool), np.zeros(3, dtype=bool)
    setting = Setting(Held(), MEAN, np.diag(SD**2), noise, (), every, none, springs=SPRINGS, cuffs=cuffs)
    method, generator, way = methods.built("recursive", setting), np.random.default_rng(5), 0.0
    for k in range(3000):
        angle = 1.5 * np.sin(0.02 * k)
        strain = WAY_M_RAD * angle
        way = min(max(way, strain - 0.008), strain + 0.008)
        tau = 1.8 * angle + 10.0 * np.sin(angle) - STIFFNESS_N_M * WAY_M_RAD * way
        method.update(sample(0.02 * k, angle, tau + 0.02 * generator.standard_normal()))
    return method.estimate()


def test_the_torque_of_a_slipping_cuff_does_not_pass_for_a_restless_wearer():
    with_cuffs, without = estimate(CUFFS), estimate(None)
    assert with_cuffs.noise_scale < 0.5 * without.noise_scale
    assert with_cuffs.covariance is not None
    assert without.covariance is not None
    assert abs(with_cuffs.x[2] - 10.0) < 2.0 * np.sqrt(with_cuffs.covariance[2, 2])
    assert with_cuffs.covariance[2, 2] < without.covariance[2, 2]
