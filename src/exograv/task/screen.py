"""From pixels to millimetres: a panel measured with a ruler or with a bank card, never by what it reports."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

CARD_MM = (85.60, 53.98)
"""Width and height of an ID-1 card. Source: ISO/IEC 7810."""

PITCH_MIN_MM, PITCH_MAX_MM = 0.03, 1.0
"""A telephone's panel has 0.05, a television's 0.6: outside, one of the lengths has a slipped digit."""

ANISOTROPY_MAX = 0.03
"""Pixels of panels are square: beyond, the picture is stretched, or the card was not matched."""

SPAN_MIN_MM = 30.0
"""A shorter length is read too coarsely."""

READING_PX, READING_MM = 1.0, 0.5
"""To which two marks are set, and a ruler is read."""

Positive = Annotated[float, Field(gt=0.0, le=1e5)]


class ScreenSpan(Settings):
    """Two points on the screen and their distance."""

    dx_px: Annotated[float, Field(ge=-1e5, le=1e5)]
    dy_px: Annotated[float, Field(ge=-1e5, le=1e5)]
    """Pixels of the panel, not of the page."""

    distance_mm: Positive


class ScreenCalibration(Settings):
    """Length of a pixel of this panel."""

    pitch_x_mm: Annotated[float, Field(ge=PITCH_MIN_MM, le=PITCH_MAX_MM)]
    pitch_y_mm: Annotated[float, Field(ge=PITCH_MIN_MM, le=PITCH_MAX_MM)]
    """[mm/px]"""

    method: Literal["ruler", "card"]
    anisotropy: float | None
    """pitch_y / pitch_x - 1 as measured; None where one direction was not."""

    relative_error: Annotated[float, Field(ge=0.0)]
    """By how far marks and ruler can be read [-]."""

    def to_mm(self, dx_px: float, dy_px: float) -> tuple[float, float]:
        """A vector on the panel [mm]."""
        return self.pitch_x_mm * dx_px, self.pitch_y_mm * dy_px


def calibrate_with_card(width_px: float, height_px: float) -> ScreenCalibration:
    """From a rectangle (panel's pixels) that has been made as large as a bank card.

    Raises:
        ConfigError: No panel is like that.
    """
    _refuse_bad_numbers({"width_px": width_px, "height_px": height_px})
    pitches = CARD_MM[0] / width_px, CARD_MM[1] / height_px
    error = READING_PX / min(width_px, height_px)
    return _checked(*pitches, "card", pitches[1] / pitches[0] - 1.0, error)


def calibrate_with_ruler(spans: Sequence[ScreenSpan]) -> ScreenCalibration:
    """From one length, or from more in different directions, which then also tell whether pixels are square.

    Raises:
        ConfigError: No panel is like that, or a length is too short to be read.
    """
    if not spans:
        raise ConfigError("No length was measured on the screen. Measure one from mark to mark, at least 30 mm.")
    for span in spans:
        if span.distance_mm < SPAN_MIN_MM:
            raise ConfigError(
                f"The length on the screen is {span.distance_mm:g} mm; it must have {SPAN_MIN_MM:g} mm or more. Set "
                "the marks farther apart: a short one is read too coarsely."
            )
        if (span.dx_px, span.dy_px) == (0.0, 0.0):
            raise ConfigError("The two marks on the screen are one point. Set them apart and measure again.")
    squares = np.array([[span.dx_px**2, span.dy_px**2] for span in spans])
    distances = np.array([span.distance_mm for span in spans])
    error = max(READING_MM / s.distance_mm + READING_PX / float(np.hypot(s.dx_px, s.dy_px)) for s in spans)
    directions = squares / np.sum(squares, axis=1, keepdims=True)
    # A panel's two pitches can be told apart by spans that are really in two directions.
    if np.ptp(directions[:, 0]) < 0.5:
        pitch = float(np.mean(distances / np.sqrt(np.sum(squares, axis=1))))
        return _checked(pitch, pitch, "ruler", None, error)
    weights = 1.0 / distances**2
    solution = np.linalg.lstsq(squares * weights[:, None], np.ones(len(spans)), rcond=None)[0]
    if not np.all(solution > 0.0):
        raise ConfigError("The lengths on the screen contradict each other. Measure each again, from mark to mark.")
    pitch_x, pitch_y = (float(pitch) for pitch in np.sqrt(solution))
    return _checked(pitch_x, pitch_y, "ruler", pitch_y / pitch_x - 1.0, error)


def _refuse_bad_numbers(values: dict[str, float]) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and 0.0 < value <= 1e5):
            raise ConfigError(f"{name} is {value:g}; a rectangle on a screen has 1 to 100000 pixels. Match it again.")


def _checked(
    pitch_x: float, pitch_y: float, method: Literal["ruler", "card"], anisotropy: float | None, error: float
) -> ScreenCalibration:
    for axis, pitch in (("width", pitch_x), ("height", pitch_y)):
        if not PITCH_MIN_MM <= pitch <= PITCH_MAX_MM:
            raise ConfigError(
                f"By this {method} a pixel has a {axis} of {pitch:.4g} mm; panels have {PITCH_MIN_MM:g} to "
                f"{PITCH_MAX_MM:g}. Check the unit of the length, and whether the page is zoomed; measure again."
            )
    if anisotropy is not None and abs(anisotropy) > ANISOTROPY_MAX:
        raise ConfigError(
            f"By this {method} pixels are {100.0 * anisotropy:+.1f} % higher than wide; allowed: "
            f"{100.0 * ANISOTROPY_MAX:g} %. Set the panel to its own resolution, without stretching; measure again."
        )
    return ScreenCalibration(
        pitch_x_mm=pitch_x, pitch_y_mm=pitch_y, method=method, anisotropy=anisotropy, relative_error=error
    )
