"""Of a protocol: what is shown, which touches count, and when an aircraft's g opens a window."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exograv.model.rig_settings import Settings


class Sign(Settings):
    """What is shown: a shape and a colour, so that neither alone has to be told apart."""

    shape: Literal["up", "down", "left", "right", "none"]
    colour: Literal["red", "green", "white", "none"]


class PaceSettings(Settings):
    """The arrow that tells whether touches follow each other too soon or too late."""

    shown: bool
    tolerance_s: Annotated[float, Field(gt=0.0, le=60.0)]
    """To either side of the interval."""

    too_short: Sign
    right: Sign
    too_long: Sign

    @model_validator(mode="after")
    def _told_apart_by_shape(self) -> "PaceSettings":
        if len({self.too_short.shape, self.right.shape, self.too_long.shape}) < 3:
            raise ValueError("too_short, right and too_long need three shapes: colours alone not everybody can tell")
        return self


class TargetSettings(Settings):
    """The disc on the screen."""

    diameter_mm: Annotated[float, Field(gt=0.0, le=500.0)]
    """On a calibrated screen."""

    diameter_px: Annotated[float, Field(gt=0.0, le=5000.0)]
    """On one that is not: of the screen, not of the page."""

    visible: Literal["upper", "lower", "left", "right", "whole"]
    """The half that is drawn."""

    x_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    y_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Of its centre, of the screen's width and height, from the upper left."""


class PointingSettings(Settings):
    """Which touches count."""

    return_check: Literal["time", "sensor", "fingertip", "joints"]
    """By what the hand is known to have been at its resting place since the last touch."""

    return_after_s: Annotated[float, Field(ge=0.0, le=60.0)]
    """With `time`: sooner than this after the last touch the hand has not been there."""

    rest_radius_mm: Annotated[float, Field(gt=0.0, le=1000.0)]
    """With `fingertip`: how near to the resting place is there."""

    rest_radius_deg: Annotated[float, Field(gt=0.0, le=180.0)]
    """With `joints`: how far the farthest joint may be from the resting posture."""

    bounce_s: Annotated[float, Field(ge=0.0, le=2.0)]
    """A touch sooner than this after the last is the same one."""

    contact_max_mm: Annotated[float, Field(gt=0.0, le=200.0)]
    contact_max_px: Annotated[float, Field(gt=0.0, le=5000.0)]
    """Longer contacts are a palm; of the screen's pixels where it is not calibrated."""

    area_radius_px: Annotated[float, Field(gt=0.0, le=20_000.0)]
    """A touch farther from the target was meant for something else."""

    pointers: Annotated[list[Literal["touch", "pen", "mouse"]], Field(min_length=1)]


class AircraftSettings(Settings):
    """When measured g opens and closes a window."""

    open_within_g: Annotated[float, Field(gt=0.0, le=0.5)] = 0.10
    """Of the window's level; residual g has peaks of 0.05 (docs/explanation/task.md)."""

    close_beyond_g: Annotated[float, Field(gt=0.0, le=0.8)] = 0.20
    dwell_s: Annotated[float, Field(gt=0.0, le=5.0)] = 0.45
    """So long it must last, either way."""

    silent_s: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    """Without a new sample the feed has stopped."""

    overtime_s: Annotated[float, Field(ge=0.0, le=60.0)] = 5.0
    """A window that nothing closes ends so long after its time."""

    announcements: dict[str, Literal["level", "window", "other"]] = Field(
        default={"STEADY FLIGHT": "level"}, max_length=50
    )
    """What the aircraft's texts mean; only this one is known, and a text never opens or closes anything."""

    @model_validator(mode="after")
    def _hysteresis(self) -> "AircraftSettings":
        if self.open_within_g >= self.close_beyond_g:
            raise ValueError(
                f"close_beyond_g {self.close_beyond_g:g} must be above open_within_g {self.open_within_g:g}"
            )
        return self
