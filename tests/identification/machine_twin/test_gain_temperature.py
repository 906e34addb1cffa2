"""The gain by temperature is told with its interval where temperatures varied, and nowhere else."""

import numpy as np
import pytest

from exograv.identification.machine_twin.gain_temperature import VARIED_LEAST_C, slope_of_gain

SAMPLES, DT_S = 3000, 0.1
KNOWN = np.ones(SAMPLES, dtype=bool)
SIGMAS = 4.0


def motion(seed: int, rise_C: float, slope_per_C: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return nominal torque, residual, velocity and temperature of a joint that swings a load while its motor warms."""
    rng, t = np.random.default_rng(seed), DT_S * np.arange(SAMPLES)
    v, load = np.cos(0.5 * t), 6.0 * np.sin(0.5 * t + 0.4) + 2.0 * np.sin(0.11 * t)
    temperature = 25.0 + rise_C * (1.0 - np.exp(-t / 90.0))
    noise = np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        noise[k] = 0.9 * noise[k - 1] + rng.normal(0.0, 0.05)
    warmer = temperature - temperature.mean()
    # The fit has put a wrong share into gain and friction, and friction falls as the gear warms up.
    residual = -slope_per_C * warmer * load + 0.02 * load + (0.1 - 0.01 * warmer) * np.sign(v) + noise
    return load, residual, v, temperature


@pytest.mark.parametrize("slope_per_C", [0.0, -0.002, 0.004])
def test_the_true_slope_is_within_its_interval_in_spite_of_warmer_friction(slope_per_C: float):
    errors = []
    for seed in range(8):
        load, residual, v, temperature = motion(seed, 30.0, slope_per_C)
        slope, sd = slope_of_gain(load, residual, v, temperature, KNOWN)
        assert sd < 1e-3
        errors.append((slope - slope_per_C) / sd)
    assert max(np.abs(errors)) < SIGMAS


@pytest.mark.parametrize("rise_C", [0.0, 0.9 * VARIED_LEAST_C])
def test_a_temperature_that_hardly_varies_tells_nothing(rise_C: float):
    load, residual, v, temperature = motion(0, rise_C, 0.004)
    assert np.isnan(slope_of_gain(load, residual, v, temperature, KNOWN)).all()


def test_a_load_that_never_changes_tells_nothing():
    _, residual, v, temperature = motion(0, 30.0, 0.004)
    assert np.isnan(slope_of_gain(np.sign(v), residual, v, temperature, KNOWN)).all()
