"""A wearer who does not relax has the stated strength, correlation time and rate of bursts."""

import numpy as np
import pytest

from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.disturbances.ornstein_uhlenbeck import BLOCK
from exograv.rig.twin.wearer.muscles import Muscles

PERIOD = 0.001


def torques(disturbances: Disturbances, seconds: float, seed: int = 0) -> np.ndarray:
    muscles = Muscles(draw_wearer(disturbances, 0).arms[0].unrest, seed, PERIOD)
    n = round(seconds / PERIOD)
    return np.concatenate([muscles.next_block() for _ in range(-(-n // BLOCK))])[:n]


def test_torque_comes_tick_by_tick_as_it_was_drawn_block_by_block():
    unrest = draw_wearer(Disturbances.at_level(4), 0).arms[0].unrest
    by_tick, by_block = (Muscles(unrest, 0, PERIOD) for _ in range(2))
    first = by_tick.next_torque().copy()
    for _ in range(BLOCK - 1):
        by_tick.next_torque()
    np.testing.assert_array_equal(by_tick.next_torque(), by_block.next_block()[0])
    assert (first != by_tick.next_torque()).any()


def test_a_relaxed_wearer_does_nothing():
    assert (torques(Disturbances.at_level(0), 10.0) == 0.0).all()


def test_the_slow_bias_has_the_stated_strength_and_correlation():
    calm = Disturbances.at_level(2).without("bursts")
    unrest = draw_wearer(calm, 0).arms[0].unrest
    runs = [torques(calm, 200.0, seed) for seed in range(3)]
    rms = np.sqrt(np.mean(np.square(runs), axis=(0, 1)))
    # 600 s hold some 100 independent values: the RMS is known to about 7 %.
    np.testing.assert_allclose(rms, [0.3, 0.3, 0.3, 0.15], rtol=0.2)
    lag = round(0.2 / PERIOD)
    for joint in range(4):
        correlation = np.mean([np.corrcoef(run[:-lag, joint], run[lag:, joint])[0, 1] for run in runs])
        assert correlation == pytest.approx(np.exp(-0.2 / unrest.bias_correlation[joint]), abs=0.05)


def test_the_bias_does_not_jump_where_one_block_ends():
    bias = torques(Disturbances.at_level(2).without("bursts"), 3.0 * BLOCK * PERIOD)
    steps = np.abs(np.diff(bias, axis=0))
    assert steps[BLOCK - 1 :: BLOCK].max() < 6.0 * steps.std(axis=0).max()


def test_bursts_come_as_often_and_as_strong_as_the_level_says():
    worst = Disturbances.at_level(4).without("slow_bias")
    counts, strongest = [], []
    for seed in range(4):
        active = np.abs(torques(worst, 120.0, seed)).sum(axis=1)
        begins = np.flatnonzero((active[1:] > 0.0) & (active[:-1] == 0.0))
        counts.append(len(begins))
        strongest.append(active.max())
    assert np.sum(counts) == pytest.approx(4 * 2 * 6, abs=3 * np.sqrt(48))  # Poisson, three sigma
    assert min(strongest) > 2.0


def test_bursts_last_between_a_third_of_a_second_and_one():
    active = np.abs(torques(Disturbances.at_level(3).without("slow_bias"), 120.0)).max(axis=1) > 0.0
    edges = np.flatnonzero(np.diff(active.astype(int)))
    lengths = np.diff(edges)[::2] * PERIOD
    assert lengths.min() >= 0.29
    assert lengths.max() <= 2.1  # two may overlap
