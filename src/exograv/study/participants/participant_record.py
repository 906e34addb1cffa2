"""What a study keeps of a participant: group, consent, and body data in bands, never the number that was told."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

from .codes import is_code

SEALED = "sealed"
"""In place of a group that is not to be known yet."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]
Band = Annotated[str, Field(pattern=r"^\d{1,3}-\d{1,3}$")]
Sex = Literal["f", "m", "x"]
Hand = Literal["right", "left", "both"]

BAND = 10
"""Years, centimetres, kilograms."""

RANGES = {"age": (5, 110), "height_cm": (80, 230), "mass_kg": (15, 250)}
"""What a person may be told to have."""


class ParticipantRow(Settings):
    """One person."""

    code: str
    group: Name
    """One of the study's, or `sealed`."""

    consent: Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,20}$")] | None = None
    age_band: Band | None = None
    sex: Sex | None = None
    height_band_cm: Band | None = None
    mass_band_kg: Band | None = None
    handedness: Hand | None = None

    @field_validator("code")
    @classmethod
    def _is_code(cls, code: str) -> str:
        if not is_code(code):
            raise ValueError("is no code: its check character is wrong")
        return code


def band(name: str, value: float | None) -> str | None:
    """The ten that a value lies in, such as `170-179`.

    Args:
        name: Of `RANGES`.
        value: What was told.

    Raises:
        ConfigError: No person has that. The value is not repeated.
    """
    if value is None:
        return None
    low, high = RANGES[name]
    if not low <= value <= high:
        raise ConfigError(f"What was told for {name} is out of the range of people, {low} to {high}. Check its unit.")
    first = int(value // BAND) * BAND
    return f"{first}-{first + BAND - 1}"
