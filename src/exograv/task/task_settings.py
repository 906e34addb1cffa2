"""Settings of a protocol for signs, target, accepted touches, and the aircraft's windows."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exograv.model.rig_settings import Settings


class Sign(Settings):
    """Sign on the page. It has a shape and a colour, so that a person who cannot tell one apart sees the other."""

    shape: Literal["up", "down", "left", "right", "none"]
    colour: Literal["red", "green", "white", "none"]


class PaceSettings(Settings):
    """Arrow that shows if touches follow each other too soon or too late."""

    shown: bool
    tolerance_s: Annotated[float, Field(gt=0.0, le=60.0)]
    """Tolerance to either side of the interval."""

    too_short: Sign
    right: Sign
    too_long: Sign

    @model_validator(mode="after")
    def _told_apart_by_shape(self) -> "PaceSettings":
        if len({self.too_short.shape, self.right.shape, self.too_long.shape}) < 3:
            raise ValueError(
                "too_short, right and too_long need three different shapes, because some people cannot tell the "
                "colours apart"
            )
        return self


class TargetSettings(Settings):
    """Target disc on the screen."""

    diameter_mm: Annotated[float, Field(gt=0.0, le=500.0)]
    """Diameter on a calibrated screen."""

    diameter_px: Annotated[float, Field(gt=0.0, le=5000.0)]
    """Diameter on a screen without calibration, in pixels of the screen, not of the page."""

    visible: Literal["upper", "lower", "left", "right", "whole"]
    """Part of the disc that is drawn."""

    x_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    y_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Position of the centre, as fractions of the screen's width and height from the upper left."""


class PointingSettings(Settings):
    """Criteria for accepted touches."""

    return_check: Literal["time", "sensor", "fingertip", "joints"]
    """Evidence that the hand was at its resting place since the last touch."""

    return_after_s: Annotated[float, Field(ge=0.0, le=60.0)]
    """Setting for `time`: shortest time between two touches with a return of the hand between them."""

    rest_radius_mm: Annotated[float, Field(gt=0.0, le=1000.0)]
    """Setting for `fingertip`: largest distance from the resting place at which the hand counts as back."""

    rest_radius_deg: Annotated[float, Field(gt=0.0, le=180.0)]
    """Setting for `joints`: largest deviation of any joint from the resting posture."""

    bounce_s: Annotated[float, Field(ge=0.0, le=2.0)]
    """Shortest time between two different touches. A sooner one is the same touch."""

    contact_max_mm: Annotated[float, Field(gt=0.0, le=200.0)]
    contact_max_px: Annotated[float, Field(gt=0.0, le=5000.0)]
    """Largest contact of a finger; longer ones are a palm. Pixels of the screen are used without calibration."""

    area_radius_px: Annotated[float, Field(gt=0.0, le=20_000.0)]
    """Largest distance of a touch from the target. A farther one was meant for something else."""

    pointers: Annotated[list[Literal["touch", "pen", "mouse"]], Field(min_length=1)]


class AircraftSettings(Settings):
    """Limits of the measured g that open and close a window."""

    open_within_g: Annotated[float, Field(gt=0.0, le=0.5)] = 0.10
    """Largest deviation from the window's level at its opening.

    Residual g has peaks of 0.05 (docs/explanation/task.md).
    """

    close_beyond_g: Annotated[float, Field(gt=0.0, le=0.8)] = 0.20
    dwell_s: Annotated[float, Field(gt=0.0, le=5.0)] = 0.45
    """Duration for which g must be beyond its limit before a window opens or closes [s]."""

    silent_s: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    """Time without a new sample after which the feed counts as lost."""

    overtime_s: Annotated[float, Field(ge=0.0, le=60.0)] = 5.0
    """Time after the nominal end at which the clock closes a window that nothing else has closed."""

    announcements: dict[str, Literal["level", "window", "other"]] = Field(
        default={"STEADY FLIGHT": "level"}, max_length=50
    )
    """Meanings of the aircraft's texts. Only this text is known. A text never opens or closes a window."""

    @model_validator(mode="after")
    def _hysteresis(self) -> "AircraftSettings":
        if self.open_within_g >= self.close_beyond_g:
            raise ValueError(
                f"close_beyond_g {self.close_beyond_g:g} must be above open_within_g {self.open_within_g:g}"
            )
        return self
