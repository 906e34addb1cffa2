"""Calibration of pixels in millimetres, with a ruler or a bank card. The size that a panel reports is not used."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

CARD_MM = (85.60, 53.98)
"""Width and height of an ID-1 card. Source: ISO/IEC 7810."""

PITCH_MIN_MM, PITCH_MAX_MM = 0.03, 1.0
"""Limits of a plausible pixel [mm/px]. A telephone has 0.05, a television 0.6; outside, a length has a wrong digit."""

ANISOTROPY_MAX = 0.03
"""Largest deviation from square pixels. Beyond, the picture is stretched, or the card was not matched."""

SPAN_MIN_MM = 30.0
"""Shortest length that a ruler measures precisely enough [mm]."""

READING_PX, READING_MM = 1.0, 0.5
"""Resolution of setting two marks [px], and of reading a ruler [mm]."""

Positive = Annotated[float, Field(gt=0.0, le=1e5)]


class ScreenSpan(Settings):
    """Two points on the screen and their distance."""

    dx_px: Annotated[float, Field(ge=-1e5, le=1e5)]
    dy_px: Annotated[float, Field(ge=-1e5, le=1e5)]
    """Pixels of the panel, not of the page."""

    distance_mm: Positive


class ScreenCalibration(Settings):
    """Size of a pixel of this panel."""

    pitch_x_mm: Annotated[float, Field(ge=PITCH_MIN_MM, le=PITCH_MAX_MM)]
    pitch_y_mm: Annotated[float, Field(ge=PITCH_MIN_MM, le=PITCH_MAX_MM)]
    """Distance between pixels in each direction [mm/px]."""

    method: Literal["ruler", "card"]
    anisotropy: float | None
    """pitch_y / pitch_x - 1 as measured; None if only one direction was measured."""

    relative_error: Annotated[float, Field(ge=0.0)]
    """Relative error from the resolution of marks and ruler [-]."""

    def to_mm(self, dx_px: float, dy_px: float) -> tuple[float, float]:
        """Vector on the panel [mm]."""
        return self.pitch_x_mm * dx_px, self.pitch_y_mm * dy_px


def calibrate_with_card(width_px: float, height_px: float) -> ScreenCalibration:
    """Calibrate from a rectangle (panel's pixels) that was matched to a bank card.

    Raises:
        ConfigError: No panel has such pixels.
    """
    _refuse_bad_numbers({"width_px": width_px, "height_px": height_px})
    pitches = CARD_MM[0] / width_px, CARD_MM[1] / height_px
    error = READING_PX / min(width_px, height_px)
    return _checked(*pitches, "card", pitches[1] / pitches[0] - 1.0, error)


def calibrate_with_ruler(spans: Sequence[ScreenSpan]) -> ScreenCalibration:
    """Calibrate from one length, or from several. In different directions they also test if pixels are square.

    Raises:
        ConfigError: No panel has such pixels, or a length is too short.
    """
    if not spans:
        raise ConfigError("No length was measured on the screen. Measure one from mark to mark, at least 30 mm.")
    for span in spans:
        if span.distance_mm < SPAN_MIN_MM:
            raise ConfigError(
                f"The length on the screen is {span.distance_mm:g} mm; allowed: {SPAN_MIN_MM:g} mm or more. Set "
                "the marks farther apart, because a ruler measures short lengths too coarsely."
            )
        if (span.dx_px, span.dy_px) == (0.0, 0.0):
            raise ConfigError("The two marks on the screen are at the same point. Set them apart and measure again.")
    squares = np.array([[span.dx_px**2, span.dy_px**2] for span in spans])
    distances = np.array([span.distance_mm for span in spans])
    error = max(READING_MM / s.distance_mm + READING_PX / float(np.hypot(s.dx_px, s.dy_px)) for s in spans)
    directions = squares / np.sum(squares, axis=1, keepdims=True)
    # The two pitches of a panel can only be estimated from spans in two clearly different directions.
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
                f"According to the {method}, a pixel has a {axis} of {pitch:.4g} mm; panels have {PITCH_MIN_MM:g} to "
                f"{PITCH_MAX_MM:g} mm. Check the unit of the length, and whether the page is zoomed; measure again."
            )
    if anisotropy is not None and abs(anisotropy) > ANISOTROPY_MAX:
        raise ConfigError(
            f"According to the {method}, pixels are {100.0 * anisotropy:+.1f} % higher than wide; allowed: "
            f"{100.0 * ANISOTROPY_MAX:g} %. Set the panel to its own resolution, without stretching; measure again."
        )
    return ScreenCalibration(
        pitch_x_mm=pitch_x, pitch_y_mm=pitch_y, method=method, anisotropy=anisotropy, relative_error=error
    )
