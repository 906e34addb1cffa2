"""The size of a pixel is measured with a card or a ruler, in both directions. Implausible sizes are rejected."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.task.screen import CARD_MM, ScreenSpan, calibrate_with_card, calibrate_with_ruler

PITCH = st.floats(0.05, 0.6)


def span(pitch_x: float, pitch_y: float, dx: float, dy: float) -> ScreenSpan:
    """Measurement of a ruler without error."""
    return ScreenSpan(dx_px=dx, dy_px=dy, distance_mm=float(np.hypot(pitch_x * dx, pitch_y * dy)))


@given(pitch=PITCH, stretch=st.floats(0.98, 1.02))
def test_a_card_gives_back_the_pitch_of_both_directions(pitch: float, stretch: float):
    found = calibrate_with_card(CARD_MM[0] / pitch, CARD_MM[1] / (pitch * stretch))
    np.testing.assert_allclose([found.pitch_x_mm, found.pitch_y_mm], [pitch, pitch * stretch], rtol=1e-9)
    assert found.anisotropy == pytest.approx(stretch - 1.0, abs=1e-9)


@given(pitch=PITCH, stretch=st.floats(0.98, 1.02), tilt=st.floats(0.0, 0.2))
def test_two_lengths_across_each_other_give_both_pitches_however_they_lie(pitch: float, stretch: float, tilt: float):
    c, s = 1500 * np.cos(tilt), 1500 * np.sin(tilt)
    found = calibrate_with_ruler([span(pitch, pitch * stretch, c, s), span(pitch, pitch * stretch, -s, c)])
    np.testing.assert_allclose([found.pitch_x_mm, found.pitch_y_mm], [pitch, pitch * stretch], rtol=1e-7)


def test_one_length_says_nothing_of_the_other_direction():
    found = calibrate_with_ruler([span(0.277, 0.277, 400.0, 300.0)])
    assert found.anisotropy is None
    np.testing.assert_allclose([found.pitch_x_mm, found.pitch_y_mm], 0.277, rtol=1e-9)


@pytest.mark.parametrize(
    ("inches", "pitch"),
    [(15.6, 0.18), (24.0, 0.277), (27.0, 0.311)],
)
def test_panels_of_1920_pixels_have_the_pitches_of_the_table(inches: float, pitch: float):
    width_mm = 25.4 * inches * 16 / np.hypot(16, 9)
    found = calibrate_with_ruler([ScreenSpan(dx_px=1920.0, dy_px=0.0, distance_mm=width_mm)])
    assert found.pitch_x_mm == pytest.approx(pitch, abs=0.0005)
    assert found.to_mm(50.0, 0.0)[0] == pytest.approx(50.0 * found.pitch_x_mm)


def test_a_longer_length_is_known_better():
    short, long = (calibrate_with_ruler([span(0.2, 0.2, dx, 0.0)]) for dx in (200.0, 1500.0))
    assert 0.0 < long.relative_error < short.relative_error


@pytest.mark.parametrize(
    ("measure", "says"),
    [
        (lambda: calibrate_with_card(309.0, 260.0), "higher than wide"),
        (lambda: calibrate_with_card(0.0, 200.0), "width_px is 0"),
        (lambda: calibrate_with_card(float("nan"), 200.0), "width_px is nan"),
        (lambda: calibrate_with_card(10.0, 6.0), "a pixel has a width of 8.56 mm"),
        (lambda: calibrate_with_ruler([]), "No length"),
        (lambda: calibrate_with_ruler([ScreenSpan(dx_px=0.0, dy_px=0.0, distance_mm=100.0)]), "at the same point"),
        (lambda: calibrate_with_ruler([ScreenSpan(dx_px=900.0, dy_px=0.0, distance_mm=25.0)]), "30 mm or more"),
        (lambda: calibrate_with_ruler([ScreenSpan(dx_px=9000.0, dy_px=0.0, distance_mm=100.0)]), "Check the unit"),
    ],
)
def test_what_no_panel_has_is_refused_with_the_next_step(measure, says: str):
    with pytest.raises(ConfigError, match=says):
        measure()
