"""Record of a participant in a study: group, consent, and body data in bands. Exact body data are never stored."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

from .codes import is_code

SEALED = "sealed"
"""Placeholder for a group that is still sealed."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]
Band = Annotated[str, Field(pattern=r"^\d{1,3}-\d{1,3}$")]
Sex = Literal["f", "m", "x"]
Hand = Literal["right", "left", "both"]

BAND = 10
"""Width of a band [years, cm, kg]."""

RANGES = {"age": (5, 110, "years", 34), "height": (80, 230, "cm", 178), "mass": (15, 250, "kg", 74)}
"""Smallest and largest value that is accepted for a person, its unit, and an example, by option."""


class ParticipantRow(Settings):
    """Record of one participant."""

    code: str
    group: Name
    """Group of the study, or `sealed`."""

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
            raise ValueError("is not a code: its check character is wrong")
        return code


def band(name: str, value: float | None) -> str | None:
    """Return the band of ten in which a value lies, such as `170-179`.

    Args:
        name: Key of `RANGES`.
        value: Stated value.

    Raises:
        ConfigError: No person has such a value. The message does not repeat the value.
    """
    if value is None:
        return None
    low, high, unit, example = RANGES[name]
    if not low <= value <= high:
        raise ConfigError(
            f"--{name} is outside the range of people; allowed: {low} to {high} {unit}, such as --{name} {example}. "
            "The value is personal data, so this message does not repeat it."
        )
    first = int(value // BAND) * BAND
    return f"{first}-{first + BAND - 1}"
