"""The process has the given spread and correlation time, at any period."""

import numpy as np
import pytest
from scipy.signal import lfilter

from exograv.rig.twin.disturbances.ornstein_uhlenbeck import BLOCK, OrnsteinUhlenbeck

BLOCKS = 32


@pytest.mark.parametrize("period_s", [0.001, 0.002])
def test_spread_and_memory_are_as_told(period_s: float):
    wander = OrnsteinUhlenbeck(np.full(200, 0.5), 100.0 * period_s, period_s, np.random.default_rng(1000))
    rows = np.vstack([wander.block() for _ in range(BLOCKS)])
    assert len(rows) == BLOCKS * BLOCK
    assert rows.std() == pytest.approx(0.5, rel=0.03)
    after = (rows[100:] * rows[:-100]).mean() / (rows**2).mean()
    assert after == pytest.approx(np.exp(-1.0), abs=0.03)


def test_a_block_is_the_linear_filter_of_its_kicks_and_goes_on_from_the_block_before():
    sd, lasts_s = np.array([0.3, 0.0, 2.0]), np.array([3.0, 1.0, 0.5])
    decay, random = np.exp(-1e-3 / lasts_s), np.random.default_rng(1000)
    process, value = OrnsteinUhlenbeck(sd, lasts_s, 1e-3, np.random.default_rng(1000)), sd * random.standard_normal(3)
    for _ in range(2):
        kicks, block = random.standard_normal((BLOCK, 3)) * sd * np.sqrt(1.0 - decay**2), process.block()
        for entry in range(3):
            start = [decay[entry] * value[entry]]
            expected, _ = lfilter([1.0], [1.0, -decay[entry]], kicks[:, entry], zi=start)
            np.testing.assert_array_equal(block[:, entry], expected)
        value = block[-1]
