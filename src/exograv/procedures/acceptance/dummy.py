"""Dummy arm of known masses: its file, its inertial parameters, and the uncertainty of both."""

import hashlib
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from exograv.errors import ConfigError
from exograv.model.anthropometry import Body, Sex
from exograv.model.description import RigDescription, validation_sentences
from exograv.model.rig_settings import Settings
from exograv.model.tree import inertial_parameters
from exograv.model.wearer_form import WearerForm

SHIPPED = Path(__file__).parent / "dummy.toml"
"""File of the dummy that the how-to page draws."""

SIZE_MAX_BYTES = 100_000

LimbSegment = Literal["upper_arm", "forearm"]
LIMB: tuple[LimbSegment, LimbSegment] = ("upper_arm", "forearm")
Length = Annotated[float, Field(ge=0.05, le=0.5)]
Phi = Float[np.ndarray, " 10"]


class DummyLengths(Settings):
    """Lengths of the dummy [m], as those of an arm."""

    upper_arm: Length
    forearm: Length
    hand: Length


class DummyForm(Settings):
    """Form of a person with a similar arm, from which the identification starts."""

    height_m: float
    mass_kg: float
    sex: Sex


class DummyUncertainty(Settings):
    """Largest errors of the dummy's numbers (95 %)."""

    mass_g: NonNegativeFloat
    """Error of the mass of each part."""
    place_mm: NonNegativeFloat
    """Error of the place of each part along the limb."""
    shoulder_mm: NonNegativeFloat
    """Distance of the shoulder joint from the centre of the machine's shoulder axes, along each axis."""


class Bearings(Settings):
    """Friction of the dummy's joints."""

    damping_Nms_per_rad: NonNegativeFloat


class DummyPart(Settings):
    """Rotationally symmetric part about the axis of its limb."""

    name: str
    segment: LimbSegment
    mass_kg: Annotated[PositiveFloat, Field(le=20.0)]
    at_m: Annotated[float, Field(ge=-0.1, le=0.6)]
    """Distance of the part's middle from the joint above it, along the limb."""
    length_m: PositiveFloat
    outer_mm: PositiveFloat
    inner_mm: NonNegativeFloat

    @model_validator(mode="after")
    def _is_hollow(self) -> "DummyPart":
        if self.inner_mm >= self.outer_mm:
            raise ValueError(f"inner_mm of '{self.name}' must be smaller than outer_mm")
        return self

    def phi(self, mass_kg: float, at_m: float) -> Phi:
        """Inertial parameters of this part with another mass and place, about the joint above it."""
        squares = (0.5e-3 * self.outer_mm) ** 2 + (0.5e-3 * self.inner_mm) ** 2
        across = mass_kg * (squares / 4.0 + self.length_m**2 / 12.0)
        inertia = np.diag([across, across, mass_kg * squares / 2.0])
        return inertial_parameters(mass_kg, np.array([0.0, 0.0, -at_m]), inertia)


class DummySettings(Settings):
    """Content of the file of a dummy."""

    schema_version: Literal[1]
    name: str
    lengths_m: DummyLengths
    form: DummyForm
    within: DummyUncertainty
    bearings: Bearings
    parts: Annotated[list[DummyPart], Field(min_length=2, max_length=100)]

    @model_validator(mode="after")
    def _has_both_segments(self) -> "DummySettings":
        missing = [segment for segment in LIMB if not any(part.segment == segment for part in self.parts)]
        if missing:
            raise ValueError(f"no part belongs to {missing[0]}")
        return self


@dataclass(frozen=True)
class Dummy:
    """Dummy arm with its file."""

    settings: DummySettings
    path: Path
    sha256: str
    """Hash of the file."""

    def phi(self, segment: LimbSegment) -> Phi:
        """Inertial parameters of a segment about the joint above it; the hook belongs to the forearm."""
        return _summed(part.phi(part.mass_kg, part.at_m) for part in self.parts_of(segment))

    def parts_of(self, segment: LimbSegment) -> list[DummyPart]:
        """Return the parts of a segment."""
        return [part for part in self.settings.parts if part.segment == segment]

    def phi_covariance(self, segment: LimbSegment) -> Float[np.ndarray, "10 10"]:
        """Covariance of `phi` by the errors that the file states for masses and places."""
        within = self.settings.within
        columns = []
        for part in self.parts_of(segment):
            nominal = part.phi(part.mass_kg, part.at_m)
            mass, place = 0.5e-3 * within.mass_g, 0.5e-3 * within.place_mm
            columns += [part.phi(part.mass_kg + mass, part.at_m) - nominal]
            columns += [part.phi(part.mass_kg, part.at_m + place) - nominal]
        spread = np.array(columns).T
        return spread @ spread.T

    def drawn_phi(self, segment: LimbSegment, random: np.random.Generator) -> Phi:
        """Draw the inertial parameters of a dummy that a workshop has built to this file."""
        within = self.settings.within
        return _summed(
            part.phi(
                part.mass_kg + 0.5e-3 * within.mass_g * random.standard_normal(),
                part.at_m + 0.5e-3 * within.place_mm * random.standard_normal(),
            )
            for part in self.parts_of(segment)
        )

    @cached_property
    def body(self) -> Body:
        """Body data from which the identification starts.

        Raises:
            ConfigError: The form is not that of a person.
        """
        form = self.settings.form
        return Body(form.height_m, form.mass_kg, form.sex, self.settings.lengths_m.model_dump())

    def form_for(self, description: RigDescription) -> WearerForm:
        """Form of this dummy in a machine, with the lengths to which the machine is set.

        Raises:
            ConfigError: The machine moves a wrist, or cannot be set to the dummy's lengths.
        """
        kind = description.settings.wearer.arm
        if kind != "shoulder_elbow":
            raise ConfigError(
                f"{description.name} also moves the forearm's roll or the wrist, and the dummy has a shoulder and an "
                "elbow only: this machine cannot be accepted with it."
            )
        lengths = self.settings.lengths_m.model_dump()
        adjusted = {}
        for one in description.settings.adjustments:
            length = lengths[one.segment]
            if not one.min_m <= length <= one.max_m:
                raise ConfigError(
                    f"{self.path}: {one.segment} is {length:g} m; {description.name} can be set from {one.min_m:g} to "
                    f"{one.max_m:g} m. Build a dummy of another length, and give its file with --dummy."
                )
            adjusted[one.segment] = length
        return WearerForm(self.body, adjusted)


def load_dummy(path: Path | None = None) -> Dummy:
    """Read the file of a dummy; the one that comes with exograv if no path is given.

    Raises:
        ConfigError: The file cannot be read, or a value is not allowed.
    """
    path = path or SHIPPED
    again = f"Copy {SHIPPED} and change its numbers."
    try:
        if path.stat().st_size > SIZE_MAX_BYTES:
            raise ConfigError(f"{path} has more than {SIZE_MAX_BYTES} bytes: it is no file of a dummy. {again}")
        data = path.read_bytes()
        settings = DummySettings.model_validate(tomllib.loads(data.decode("utf-8")))
    except OSError as error:
        raise ConfigError(f"--dummy is {path}, which cannot be read: {error.strerror}. {again}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML ({error}). {again}") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} {again}") from error
    dummy = Dummy(settings, path, hashlib.sha256(data).hexdigest())
    _ = dummy.body
    return dummy


def _summed(parts: Iterable[Phi]) -> Phi:
    return np.sum(list(parts), axis=0)
