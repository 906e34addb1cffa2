"""A machine's folder: its URDF and what URDF cannot say (cuffs, drives, adjustments), read and checked first."""

import difflib
import hashlib
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from exograv.errors import ConfigError

Side = Literal["right", "left"]
Segment = Literal["upper_arm", "forearm"]
Degrees = Annotated[list[float], Field(min_length=1)]


class Settings(BaseModel):
    """Read once, never changed, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Urdf(Settings):
    """One file a side, relative to the folder."""

    right: str
    left: str


class Wearer(Settings):
    """Where the wearer's shoulder is, as far as the machine knows."""

    shoulder_centre: str


class Adjustment(Settings):
    """A length of the machine, set to the wearer's measured one: the joint's origin moves along z of its parent."""

    joint: str
    segment: Segment
    nominal_m: PositiveFloat
    min_m: PositiveFloat
    max_m: PositiveFloat


class Cuff(Settings):
    """A soft hold between a frame of the exoskeleton, z along the limb, and a segment of the arm.

    A stiffness of 0 leaves that direction free: no rotational stiffness is a point, none along the limb a sleeve.
    """

    name: str
    exo_frame: str
    segment: Segment
    along_N_per_mm: NonNegativeFloat
    across_N_per_mm: NonNegativeFloat
    about_limb_Nm_per_deg: NonNegativeFloat
    about_others_Nm_per_deg: NonNegativeFloat

    @property
    def stiffness(self) -> Float[np.ndarray, " 6"]:
        """Diagonal stiffness in the cuff's frame, z along the limb: x, y, z [N/m], then about x, y, z [N·m/rad]."""
        across, along = 1000.0 * self.across_N_per_mm, 1000.0 * self.along_N_per_mm
        about_others, about_limb = np.rad2deg([self.about_others_Nm_per_deg, self.about_limb_Nm_per_deg])
        return np.array([across, across, along, about_others, about_others, about_limb])


class Donning(Settings):
    """The posture in which the cuffs are fastened."""

    posture_deg: Degrees


class Actuator(Settings):
    """A drive by its data sheet; what it really does is calibrated (`dynamics.actuator`)."""

    joint: str
    drive: Literal["harmonic", "quasi_direct"]
    torque_constant_Nm_per_A: PositiveFloat
    gear_ratio: PositiveFloat
    efficiency: Annotated[float, Field(gt=0.0, le=1.0)]
    torque_max_Nm: PositiveFloat
    rotor_inertia_kgm2: Annotated[float, Field(ge=0.0)]
    weak_kp_Nm_per_rad: PositiveFloat
    weak_kd_Nms_per_rad: PositiveFloat

    @property
    def nominal_gain(self) -> float:
        """Joint torque per motor current by the data sheet [N·m/A]."""
        return self.torque_constant_Nm_per_A * self.gear_ratio * self.efficiency


class TaskWorkspace(Settings):
    """Box of postures in which the arm must be weightless."""

    lower_deg: Degrees
    upper_deg: Degrees


class Sweep(Settings):
    """One joint moved to and fro while the others stay, with nothing and with each known weight on the mount."""

    joint: str
    from_deg: float
    to_deg: float
    posture_deg: Degrees
    """Of all joints; that of the moving one is not used."""


class Calibration(Settings):
    """Where and which known weights hang while the empty machine is calibrated, and how it moves."""

    mount: str
    weights_kg: Annotated[list[PositiveFloat], Field(min_length=2)]
    sweeps: Annotated[list[Sweep], Field(min_length=1)]


class Excitation(Settings):
    """The motion that identifies the arm: harmonics of one period about a posture, one row a harmonic."""

    period_s: PositiveFloat
    centre_deg: Degrees
    sine_deg: Annotated[list[Degrees], Field(min_length=1)]
    cosine_deg: Annotated[list[Degrees], Field(min_length=1)]


class RigSettings(Settings):
    """The whole `rig.toml`."""

    name: str
    title: str
    urdf: Urdf
    wearer: Wearer
    adjustments: list[Adjustment] = []
    cuffs: Annotated[list[Cuff], Field(min_length=1)]
    donning: Donning
    actuators: Annotated[list[Actuator], Field(min_length=1)]
    task_workspace: TaskWorkspace
    calibration: Calibration
    excitation: Excitation

    @model_validator(mode="after")
    def _one_entry_per_actuator(self) -> "RigSettings":
        n = len(self.actuators)
        lists = {
            "donning.posture_deg": self.donning.posture_deg,
            "task_workspace.lower_deg": self.task_workspace.lower_deg,
            "task_workspace.upper_deg": self.task_workspace.upper_deg,
            "excitation.centre_deg": self.excitation.centre_deg,
            **{f"calibration.sweeps of {sweep.joint}": sweep.posture_deg for sweep in self.calibration.sweeps},
            **{f"excitation.sine_deg[{k}]": row for k, row in enumerate(self.excitation.sine_deg)},
            **{f"excitation.cosine_deg[{k}]": row for k, row in enumerate(self.excitation.cosine_deg)},
        }
        for name, values in lists.items():
            if len(values) != n:
                raise ValueError(f"{name} has {len(values)} entries; it needs one for each of the {n} actuators")
        return self

    @model_validator(mode="after")
    def _ranges_and_names_agree(self) -> "RigSettings":
        joints = [actuator.joint for actuator in self.actuators]
        for kind, names in (("actuators", joints), ("cuffs", [cuff.name for cuff in self.cuffs])):
            if len(set(names)) < len(names):
                raise ValueError(f"{kind} {', '.join(names)}: two share a name")
        for place in (*self.calibration.sweeps, *self.adjustments):
            if place.joint not in joints:
                raise ValueError(f"no actuator moves '{place.joint}'; actuators are at {', '.join(joints)}")
        for low, high in zip(self.task_workspace.lower_deg, self.task_workspace.upper_deg, strict=True):
            if low >= high:
                raise ValueError(f"task_workspace.lower_deg {low} must be below upper_deg {high}")
        for a in self.adjustments:
            if not a.min_m <= a.nominal_m <= a.max_m:
                raise ValueError(f"adjustment of {a.joint}: {a.nominal_m} m must lie between {a.min_m} and {a.max_m} m")
        if len(self.excitation.sine_deg) != len(self.excitation.cosine_deg):
            raise ValueError("excitation.sine_deg and cosine_deg need as many rows as each other, one a harmonic")
        return self


@dataclass(frozen=True)
class RigDescription:
    """A machine of one side, as its folder describes it."""

    settings: RigSettings
    side: Side
    folder: Path

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.settings.name

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint list."""
        return tuple(actuator.joint for actuator in self.settings.actuators)

    @property
    def urdf_path(self) -> Path:
        """The URDF of this side."""
        return self.folder / getattr(self.settings.urdf, self.side)

    @property
    def nominal_gain(self) -> Float[np.ndarray, " joint"]:
        """Joint torque per motor current by the data sheets [N·m/A]."""
        return np.array([actuator.nominal_gain for actuator in self.settings.actuators])

    def per_actuator(self, field: str) -> Float[np.ndarray, " joint"]:
        """One numeric field of all actuators."""
        return np.array([getattr(actuator, field) for actuator in self.settings.actuators], dtype=float)

    @property
    def workspace(self) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
        """Lower and upper corner of the task workspace [rad]."""
        box = self.settings.task_workspace
        return np.deg2rad(box.lower_deg), np.deg2rad(box.upper_deg)

    @property
    def donning_posture(self) -> Float[np.ndarray, " joint"]:
        """Posture in which the cuffs are strain-free [rad]."""
        return np.deg2rad(self.settings.donning.posture_deg)

    @cached_property
    def sha256(self) -> str:
        """Hash of `rig.toml` and the URDF, stored in every recording."""
        digest = hashlib.sha256((self.folder / "rig.toml").read_bytes())
        digest.update(self.urdf_path.read_bytes())
        return digest.hexdigest()


def robots_folder() -> Path:
    """Folder of the machines that come with exograv: beside the package when installed, else in the source tree."""
    installed = Path(__file__).parents[1] / "robots"
    return installed if installed.is_dir() else Path(__file__).parents[3] / "robots"


def rig_names() -> list[str]:
    """Machines that come with exograv."""
    return sorted(path.parent.name for path in robots_folder().glob("*/rig.toml"))


def load_rig(rig: str, side: Side = "right") -> RigDescription:
    """Read a machine by its name, or by the path of its folder.

    Raises:
        ConfigError: No such machine, or its `rig.toml` holds something that cannot be used.
    """
    folder = Path(rig) if (Path(rig) / "rig.toml").is_file() else robots_folder() / rig
    path = folder / "rig.toml"
    if not path.is_file():
        near = difflib.get_close_matches(rig, rig_names(), n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        raise ConfigError(
            f"No machine '{rig}'.{hint} Known: {', '.join(rig_names())}; or give the path of a folder with a rig.toml."
        )
    try:
        settings = RigSettings.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there.") from error
    description = RigDescription(settings, side, folder)
    if not description.urdf_path.is_file():
        raise ConfigError(f"{path}: urdf.{side} names '{description.urdf_path.name}', which is not in {folder}.")
    return description


def validation_sentences(error: ValidationError) -> str:
    """What pydantic found, one sentence a finding, with place and value."""
    sentences = []
    for finding in error.errors(include_url=False):
        place = ".".join(str(part) for part in finding["loc"]) or "file"
        value = finding["input"]
        shown = f" (value {value!r})" if isinstance(value, (str, int, float, bool)) else ""
        sentences.append(f"{place}: {finding['msg']}{shown}.")
    return " ".join(sentences)
