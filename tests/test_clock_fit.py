"""The fit recovers a known offset and drift, its intervals cover them, and one late probe does not change it."""

import numpy as np
import pytest

from exograv.clock_fit import ClockFit, fit_clock, student_975

OFFSET_S, DRIFT, NOISE_S = 12.5, 40e-6, 30e-6
SEEDS = range(1000, 1200)


def measured(seed: int, count: int = 60, every_s: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    remote = 5e4 + every_s * np.arange(count)
    noise = NOISE_S * np.random.default_rng(seed).standard_normal(count)
    return remote, OFFSET_S + DRIFT * (remote - 5e4) + noise


def found(seed: int) -> ClockFit:
    fit = fit_clock(*measured(seed))
    assert fit is not None
    return fit


def test_offset_and_drift_without_noise_are_found_to_the_last_digits():
    remote, _ = measured(0)
    fit = fit_clock(remote, OFFSET_S + DRIFT * (remote - 5e4))
    assert fit is not None
    np.testing.assert_allclose(fit.correction(remote), OFFSET_S + DRIFT * (remote - 5e4), rtol=0.0, atol=1e-12)
    assert fit.drift == pytest.approx(DRIFT, abs=1e-12)


@pytest.mark.parametrize("what", ["offset", "drift"])
def test_intervals_cover_the_truth_nineteen_times_in_twenty(what: str):
    fits = [found(seed) for seed in SEEDS]
    truths = {"offset": [OFFSET_S + DRIFT * (fit.middle - 5e4) for fit in fits], "drift": [DRIFT] * len(fits)}
    intervals = [getattr(fit, f"{what}_ci95") for fit in fits]
    covered = np.mean([low <= truth <= high for (low, high), truth in zip(intervals, truths[what], strict=True)])
    assert 0.91 <= covered <= 0.985  # 0.95 ± 2.5 standard deviations of 200 draws.


def test_intervals_cover_the_drift_when_neighbouring_measurements_err_alike():
    covered, alike = list[bool](), 0.6
    for seed in SEEDS:
        remote, _ = measured(seed, count=200)
        noise, white = np.zeros(200), np.random.default_rng(seed).standard_normal(200)
        for k in range(1, 200):
            noise[k] = alike * noise[k - 1] + white[k]
        fit = fit_clock(remote, DRIFT * (remote - 5e4) + NOISE_S * noise)
        assert fit is not None
        assert fit.drift_ci95 is not None
        covered.append(fit.drift_ci95[0] <= DRIFT <= fit.drift_ci95[1])
    assert np.mean(covered) >= 0.90  # Intervals without the correction for correlation cover two of three.


def test_probes_that_waited_in_a_queue_hardly_move_the_line():
    remote, offset = measured(1000)
    plain = found(1000)
    offset[[7, 31, 50]] += 0.02
    fit = fit_clock(remote, offset)
    assert fit is not None
    assert np.max(np.abs(fit.correction(remote) - plain.correction(remote))) < NOISE_S


def test_a_measurement_that_lsl_repeats_counts_once():
    remote, offset = measured(1000)
    once, thrice = fit_clock(remote, offset), fit_clock(np.repeat(remote, 3), np.repeat(offset, 3))
    assert once is not None
    assert thrice is not None
    assert (thrice.offset, thrice.drift_ci95) == (once.offset, once.drift_ci95)
    assert len(thrice.residual) == len(remote)


def test_a_short_recording_says_nothing_of_a_drift():
    fit = fit_clock(*measured(1000, count=6))
    assert fit is not None
    assert not fit.has_drift
    assert fit.drift == 0.0
    assert fit.drift_ci95 is None


def test_one_measurement_has_no_interval_and_none_no_fit():
    fit = fit_clock(np.array([5.0]), np.array([0.1]))
    assert fit is not None
    assert (fit.offset, fit.offset_ci95) == (0.1, None)
    assert fit_clock(np.empty(0), np.empty(0)) is None


@pytest.mark.parametrize(("freedom", "value"), [(1, 12.706), (10, 2.228), (11, 2.201), (30, 2.042), (120, 1.980)])
def test_quantiles_are_those_of_the_tables(freedom: int, value: float):
    assert student_975(freedom) == pytest.approx(value, abs=0.003)
