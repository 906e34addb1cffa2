"""Rate and gaps of a stream are counted from the stamps of its samples."""

import numpy as np
import pytest

from exograv.runtime.lsl.quality import StampWatch

RATE_HZ = 250.0


def seen(stamps: np.ndarray, nominal_Hz: float = RATE_HZ, chunk: int = 7) -> StampWatch:
    watch = StampWatch(nominal_Hz)
    for begin in range(0, len(stamps), chunk):
        watch.see(stamps[begin : begin + chunk])
    return watch


@pytest.mark.parametrize("chunk", [1, 7, 1000])
@pytest.mark.parametrize("rate", [250.0, 249.0])
def test_the_rate_is_that_of_the_stamps_however_they_arrive(rate: float, chunk: int):
    watch = seen(12.0 + np.arange(2500) / rate, chunk=chunk)
    assert watch.rate_Hz == pytest.approx(rate, rel=1e-6)
    assert (watch.samples, watch.gaps) == (2500, 0)


def test_each_interval_above_two_periods_is_one_gap():
    stamps = np.arange(2500) / RATE_HZ
    stamps[1000:] += 0.5
    stamps[2000:] += 0.02
    assert seen(stamps).gaps == 2


def test_an_old_rate_does_not_stay():
    slow = np.arange(2500) / 200.0
    fast = slow[-1] + np.arange(1, 5001) / 300.0
    assert seen(np.concatenate([slow, fast])).rate_Hz == pytest.approx(300.0, rel=1e-3)


def test_a_stream_without_a_rate_has_no_gaps():
    assert seen(np.array([0.0, 5.0, 5.1, 60.0]), nominal_Hz=0.0).gaps == 0


def test_no_rate_is_stated_before_a_second_of_samples():
    assert seen(np.arange(100) / RATE_HZ).rate_Hz is None
