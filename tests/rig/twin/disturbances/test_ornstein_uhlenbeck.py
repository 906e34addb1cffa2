"""The process has the given spread and correlation time, at any period."""

import numpy as np
import pytest

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
