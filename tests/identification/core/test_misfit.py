"""Only a residual that repeats with the posture counts as a misfit, and it counts by its size."""

import numpy as np
import pytest

from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.misfit import MISFITS, misfit

FIELD_SD, NOISE_SD, SLOW_SD, STEP_S, CORRELATION_S = 0.1, 0.1, 0.2, 0.08, 3.0
SAMPLES, UNKNOWNS = 700, 5


def motion(generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Posture and velocity of two joints that repeat a motion of 10 s."""
    t = STEP_S * np.arange(SAMPLES)
    phases = generator.uniform(0.0, 2 * np.pi, (2, 3))
    waves = 2 * np.pi / 10.0 * np.arange(1, 4)
    angles = waves * t[:, None, None] + phases
    return 0.5 * np.sin(angles).sum(axis=-1), 0.5 * (waves * np.cos(angles)).sum(axis=-1)


def found(seed: int, multiple: float, slow_sd: float = SLOW_SD, explained: bool = False) -> float:
    generator = np.random.default_rng(seed)
    q, v = motion(generator)
    discrepancy = Discrepancy(np.full(2, FIELD_SD), 0.5, 16)
    fields = np.array([discrepancy.errors_of_joint(*one) for one in zip(q, v, strict=True)])
    keep = np.full(SAMPLES, np.exp(-STEP_S / CORRELATION_S))
    H = np.stack([np.sin(q), np.cos(q), q, v, np.ones_like(q)], axis=-1)
    error = multiple * np.einsum("sjc,jc->sj", fields, generator.normal(size=(2, fields.shape[-1])))
    if explained:
        error = H @ generator.normal(size=UNKNOWNS)
    slow, drive = np.zeros(2), []
    for _ in range(SAMPLES):
        slow = keep[0] * slow + np.sqrt(1 - keep[0] ** 2) * slow_sd * generator.normal(size=2)
        drive.append(slow)
    noise = np.full((SAMPLES, 2), NOISE_SD)
    y = error + np.array(drive) + noise * generator.normal(size=(SAMPLES, 2))
    return misfit(keep, H, y, fields, noise, np.full(2, slow_sd))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("multiple", [1.0, 2.0, 4.0])
def test_an_error_that_repeats_with_the_posture_is_found_within_one_step_of_sizes(seed: int, multiple: float):
    assert multiple / 2 < found(seed, multiple) < 2 * multiple


@pytest.mark.parametrize("seed", range(3))
def test_noise_and_a_wearer_who_pushes_slowly_are_no_misfit(seed: int):
    assert found(seed, 0.0, slow_sd=1.0) <= MISFITS[1]


@pytest.mark.parametrize("seed", range(3))
def test_torque_that_the_parameters_explain_is_no_misfit(seed: int):
    assert found(seed, 0.0, explained=True) <= MISFITS[1]
