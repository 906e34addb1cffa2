"""Map of a third party's arm model: which body is which segment, and which joint is which freedom."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, PositiveFloat, ValidationError, model_validator

from exograv.errors import ConfigError
from exograv.model.description import validation_sentences
from exograv.model.limb import FREEDOMS
from exograv.model.rig_settings import ArmSide, Settings
from exograv.rig.twin.wearer.regressions import Sex

Direction = Literal["x", "y", "z", "-x", "-y", "-z"]
Freedom = Literal[
    "flexion", "abduction", "rotation", "elbow", "forearm_roll", "wrist_flexion", "wrist_deviation"
]  # as model.limb.FREEDOMS
SIZE_MAX = 1_000_000
"""Largest size of the file [bytes]."""


class MappedPerson(Settings):
    """Body measures and sex of the person whom the model describes."""

    height_m: Annotated[float, Field(ge=1.2, le=2.2)]
    mass_kg: Annotated[float, Field(ge=30.0, le=200.0)]
    sex: Sex


class Segments(Settings):
    """Bodies that the cuffs hold."""

    upper_arm: str
    forearm: str
    hand: str


class MappedJoint(Settings):
    """Hinge of the model that is one freedom of the arm."""

    joint: str
    sign: Literal[1, -1] = 1
    """-1 if the joint's positive motion is the freedom's negative one."""

    zero_deg: float = 0.0
    """Angle of the joint while the arm hangs straight, palm to the body."""


class Shoulder(Settings):
    """Shoulder without hinges for flexion, abduction and rotation: a ball, or other hinges about one centre.

    Three hinges in the usual order and about the same centre replace it, so that the upper arm can turn as before.
    """

    joints: Annotated[list[str], Field(min_length=1, max_length=3)]
    zero_deg: list[float] = Field(default_factory=list)
    """Angles of the hinges while the arm hangs straight; a ball keeps its posture in the file."""


class CoupledJoint(Settings):
    """Joint that is coupled to a freedom."""

    freedom: Freedom
    polynomial: Annotated[list[float], Field(min_length=1, max_length=5)]
    """Angle [rad] or slide [m] of the joint, lowest power of the freedom's angle [rad] first."""


class BodyPoint(Settings):
    """Point on a body."""

    body: str
    at_m: Annotated[list[float], Field(min_length=3, max_length=3)]


class Points(Settings):
    """Points that do not follow from the model's joints."""

    wrist: BodyPoint | None = None
    """Centre of the wrist if no joint moves it; by default the origin of the hand's body, if the hand has its own."""

    finger_tip: BodyPoint | None = None
    """Tip of the third finger; if absent, the length of the hand follows from the person's height."""


class WearerMap(Settings):
    """Content of the map: for each segment its bodies, and for each freedom its joint."""

    title: str
    side: ArmSide
    forward: Direction
    left: Direction
    up: Direction
    """Axes of the model's world that point forward, left and up for the wearer."""

    mass_scale: PositiveFloat = 1.0
    """Factor on all masses and inertias."""

    body: MappedPerson
    segments: Segments
    freedoms: dict[Freedom, MappedJoint] = Field(default_factory=dict)
    shoulder: Shoulder | None = None
    locked: dict[str, float] = Field(default_factory=dict)
    """Joints that do not move, with their angle [°], or their position if they slide [m]."""

    lock_others: bool = False
    """True if unnamed joints of the arm stay as in the file."""

    coupled: dict[str, CoupledJoint] = Field(default_factory=dict)
    points: Points = Points()

    @model_validator(mode="after")
    def _is_consistent(self) -> "WearerMap":
        if not np.isclose(np.linalg.det(self.axes), 1.0):
            raise ValueError(
                f"forward {self.forward}, left {self.left}, up {self.up} are not right-handed axes: forward × left "
                "must be up"
            )
        by_hinge = [name for name in FREEDOMS[:3] if name in self.freedoms]
        if self.shoulder is not None and by_hinge:
            raise ValueError(f"shoulder and freedoms.{by_hinge[0]} exclude each other: give one of them")
        missing = [name for name in FREEDOMS[:3] if name not in self.freedoms]
        if self.shoulder is None and missing:
            raise ValueError(f"freedoms.{missing[0]} is missing; give it, or shoulder with the joints of a ball")
        if "elbow" not in self.freedoms:
            raise ValueError("freedoms.elbow is missing: no joint is the elbow. Give it with joint, sign and zero_deg")
        return self

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Rotation from the model's world to ours: x forward, y left, z up."""
        rows = []
        for direction in (self.forward, self.left, self.up):
            row = np.zeros(3)
            row["xyz".index(direction[-1])] = -1.0 if direction.startswith("-") else 1.0
            rows.append(row)
        return np.array(rows)


def read_wearer_map(path: Path) -> WearerMap:
    """Read and check a map.

    Raises:
        ConfigError: The map cannot be read, or has an unusable entry.
    """
    try:
        if path.stat().st_size > SIZE_MAX:
            raise ConfigError(
                f"{path} is larger than {SIZE_MAX // 1_000_000} MB, too large for a map of a wearer. Check the path."
            )
        return WearerMap.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Give the map with --wearer-map.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there.") from error
