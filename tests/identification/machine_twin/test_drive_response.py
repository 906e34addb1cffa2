"""Delay, bandwidth and noise of a drive are found from its commands, for delays between two ticks too."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.identification.machine_twin.drive_response import drive_response, encoder_step, response
from exograv.identification.machine_twin.measured_motion import MeasuredMotion

PERIOD_S, NOISE_A = 0.001, 0.05
SIGMAS = 4.0
"""Largest of some normalised errors."""


def commands(ticks: int, joints: int) -> np.ndarray:
    """Commands with steps now and then, as a machine gets them that starts and stops."""
    draw = np.random.default_rng(5)
    steps = draw.normal(0.0, 1.0, (ticks // 200, joints)).repeat(200, axis=0)
    return np.cumsum(draw.normal(0.0, 0.005, (len(steps), joints)), axis=0) + steps


def recorded(
    delay_s: float, bandwidth_Hz: tuple[float, ...], ticks: int = 20_000, walk_A: float = 0.0
) -> MeasuredMotion:
    """Return a recording; `walk_A` is the standard deviation by which the command also changes at every tick."""
    asked = commands(ticks, len(bandwidth_Hz))
    asked += np.cumsum(np.random.default_rng(8).normal(0.0, walk_A, asked.shape), axis=0)
    current = np.column_stack([response(asked[:, j], delay_s, f, PERIOD_S) for j, f in enumerate(bandwidth_Hz)])
    current += np.random.default_rng(6).normal(0.0, NOISE_A, current.shape)
    t = PERIOD_S * np.arange(len(asked))
    return MeasuredMotion("made", t, np.zeros_like(asked), current, asked, np.zeros((len(asked), 1)))


@pytest.mark.parametrize("delay_s", [0.0003, 0.0015, 0.0042])
def test_delay_and_bandwidth_are_found_within_their_intervals(delay_s: float):
    bandwidths = (15.0, 40.0)
    found = drive_response((recorded(delay_s, bandwidths),))
    assert abs(found.delay_s - delay_s) < SIGMAS * found.delay_sd_s
    assert found.delay_sd_s < 1e-4
    assert (np.abs(np.log(found.bandwidth_Hz / np.array(bandwidths))) < SIGMAS * found.bandwidth_sd_log).all()
    np.testing.assert_allclose(found.noise_A, NOISE_A, rtol=0.03)


@pytest.mark.parametrize("every", [2, 4, 5, 10])
def test_a_log_with_fewer_rows_than_commands_contains_the_true_delay_and_invents_no_second_order(every: int):
    delay_s = 0.0015
    whole = recorded(delay_s, (25.0, 25.0), 60_000, walk_A=0.1)
    rows = {name: getattr(whole, name)[::every] for name in ("t", "q", "current", "current_asked", "hung")}
    found = drive_response((MeasuredMotion("log", **rows, has_all_commands=False),))
    assert abs(found.delay_s - delay_s) < 1.96 * found.delay_sd_s
    assert np.isnan(found.damping).all()


def test_a_recording_without_commands_tells_no_delay():
    made = recorded(0.0015, (25.0,), 2000)
    silent = MeasuredMotion(
        made.name, made.t, made.q, made.current, np.full_like(made.current_asked, np.nan), made.hung
    )
    found = drive_response((silent,))
    assert np.isnan(found.delay_s)
    assert np.isnan(found.bandwidth_Hz).all()


@given(delay=st.floats(0.0, 0.005), bandwidth=st.floats(3.0, 300.0))
def test_a_response_reaches_a_constant_command(delay: float, bandwidth: float):
    step = np.concatenate([np.zeros(10), np.ones(2000)])
    assert response(step, delay, bandwidth, PERIOD_S)[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_delay_of_whole_ticks_shifts_the_response():
    asked = commands(1000, 1)[:, 0]
    prompt, late = (response(asked, delay_s, 30.0, PERIOD_S) for delay_s in (0.0, 0.003))
    np.testing.assert_allclose(late[3:], prompt[:-3], atol=1e-12)


@given(bits=st.integers(10, 20))
def test_the_step_of_an_encoder_is_found(bits: int):
    step = 2.0 * np.pi / 2.0**bits
    q = np.round(np.linspace(-0.01, 0.02, 20_000) / step) * step
    assert encoder_step(q) == pytest.approx(step, rel=1e-6)


def test_an_encoder_with_noise_gets_the_step_of_the_same_standard_deviation():
    noise_sd = 2e-5
    q = np.linspace(0.0, 1.0, 20_000) + np.random.default_rng(7).normal(0.0, noise_sd, 20_000)
    assert encoder_step(q) == pytest.approx(noise_sd * np.sqrt(12.0), rel=0.05)
