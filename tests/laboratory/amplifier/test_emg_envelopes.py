"""Simulated envelopes show the torque of the muscles with the stated error, through gains that nobody knows."""

import numpy as np
import pytest

from exograv.laboratory.amplifier.emg_envelopes import ERROR_NM, EmgEnvelopes

PERIOD_S, TICKS = 0.01, 20_000


def envelopes(torque: np.ndarray, error_factor: float, seed: int = 0) -> np.ndarray:
    source = EmgEnvelopes(torque.shape[1], PERIOD_S, seed, error_factor)
    return np.array([source.next(row) for row in torque])


def unexplained(torque: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Part of each freedom's torque that no linear map of the envelopes explains, RMS [N·m]."""
    columns = np.column_stack([shown, np.ones(len(shown))])
    return np.sqrt(np.mean((torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]) ** 2, axis=0))


def strong(freedoms: int = 3) -> np.ndarray:
    """Torque of muscles that work hard, so that the error of the envelopes is the larger unknown."""
    t = PERIOD_S * np.arange(TICKS)[:, None]
    return 15.0 * np.sin(t * (0.7 + 0.31 * np.arange(freedoms)))


def test_an_envelope_is_a_size_and_never_negative():
    assert envelopes(strong(), 1.0).min() >= 0.0


def test_silent_muscles_without_an_error_show_nothing():
    assert not envelopes(np.zeros((50, 2)), 0.0).any()


def test_each_direction_has_a_channel_of_its_own_that_shows_more_than_its_opponent():
    lifts = envelopes(np.full((50, 1), 5.0), 0.0)
    lowers = envelopes(np.full((50, 1), -5.0), 0.0)
    ratio = lifts.mean(axis=0) / lowers.mean(axis=0)
    assert ratio[0] > 2.0 > 0.5 > ratio[1]


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_error_of_the_torque_is_at_least_the_published_one(factor: float):
    assert (unexplained(strong(), envelopes(strong(), factor)) > 0.8 * factor * ERROR_NM[0]).all()


def test_gains_differ_between_wearers_and_drift():
    torque = np.full((TICKS, 1), 5.0)
    first, other = (envelopes(torque, 0.0, seed) for seed in (0, 1))
    assert not np.allclose(first[0], other[0], rtol=0.02)
    assert first[:, 0].std() > 0.05 * first[:, 0].mean()


def test_a_seed_gives_the_same_envelopes_again():
    np.testing.assert_array_equal(envelopes(strong()[:500], 1.0), envelopes(strong()[:500], 1.0))
