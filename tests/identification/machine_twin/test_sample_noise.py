"""Noise of a log behind the filter of the samples depends on the time between its rows."""

import numpy as np
import pytest

from exograv.identification.machine_twin.machine_fit import sample_noise


@pytest.mark.parametrize("times", [2, 5])
def test_noise_below_7_hz_grows_with_the_square_root_of_the_time_between_rows(times: int):
    noise = np.array([0.3, 1.0])
    often, seldom = (sample_noise(0.001 * every, noise) for every in (1, times))
    np.testing.assert_allclose(seldom / often, np.sqrt(times), rtol=0.02)
