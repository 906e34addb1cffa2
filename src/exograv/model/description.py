"""Description of a machine from its folder: URDF, and cuffs, drives and adjustments from `rig.toml`, both checked."""

import difflib
import hashlib
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pydantic import ValidationError
from pydantic_core import ErrorDetails

from exograv.errors import ConfigError
from exograv.options import Side

from .completed_urdf import completed_urdf, limits_of
from .open_questions import open_questions
from .rig_settings import Actuator as Actuator
from .rig_settings import ArmSide as ArmSide
from .rig_settings import CalibrationSettings as CalibrationSettings
from .rig_settings import Cuff as Cuff
from .rig_settings import Excitation as Excitation
from .rig_settings import JointSweep as JointSweep
from .rig_settings import Place as Place
from .rig_settings import RigSettings as RigSettings
from .urdf import text_of


@dataclass(frozen=True)
class RigDescription:
    """Machine of one side, as described in its folder."""

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
    def arm_sides(self) -> tuple[ArmSide, ...]:
        """Sides of the arms in this machine."""
        return ("right", "left") if self.side == "both" else (self.side,)

    def shoulder_centre(self, side: ArmSide) -> str:
        """Name of the machine's frame where the shoulder of this arm should be."""
        centre = self.settings.wearer.shoulder_centre
        return centre if isinstance(centre, str) else centre[side]

    @property
    def places(self) -> tuple[Place, ...]:
        """Place of each joint along the arm."""
        return tuple(actuator.place for actuator in self.settings.actuators)

    @property
    def motorless(self) -> tuple[str, ...]:
        """Joints without a motor."""
        return tuple(actuator.joint for actuator in self.settings.actuators if actuator.drive == "passive")

    @property
    def calibration(self) -> CalibrationSettings:
        """Settings of the calibration of the empty machine.

        Raises:
            ConfigError: The machine has no motor.
        """
        if self.settings.calibration is None:
            raise ConfigError(self._cannot("be calibrated: no motor's gain or friction is to be found"))
        return self.settings.calibration

    @property
    def excitation(self) -> Excitation:
        """Excitation motion that identifies an arm in the machine.

        Raises:
            ConfigError: The machine has no motor.
        """
        if self.settings.excitation is None:
            raise ConfigError(self._cannot("move an arm by itself, nor carry it"))
        return self.settings.excitation

    @property
    def mounts(self) -> tuple[str, ...]:
        """Frames where known weights can hang on the empty machine, the calibration's main mount first."""
        return () if self.settings.calibration is None else self.settings.calibration.mounts

    def _cannot(self, what: str) -> str:
        return f"{self.name} has no motors: it cannot {what}. Use a machine with motors; see `exograv rigs`."

    @property
    def urdf_path(self) -> Path:
        """Path of the URDF of this side."""
        return self.folder / getattr(self.settings.urdf, self.side)

    def urdf_text(self) -> str:
        """Text of the URDF of this side, with the joint limits that only `rig.toml` gives.

        Raises:
            ModelError: The file cannot be read.
        """
        rows = [actuator.model_dump() for actuator in self.settings.actuators]
        return completed_urdf(text_of(self.urdf_path), limits_of(rows))

    @property
    def nominal_gain(self) -> Float[np.ndarray, " joint"]:
        """Joint torque per motor current from the data sheets [N·m/A]."""
        return np.array([actuator.nominal_gain for actuator in self.settings.actuators])

    def per_actuator(self, field: str) -> Float[np.ndarray, " joint"]:
        """Values of a numeric field of all actuators; NaN if a joint has no motor."""
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

    @property
    def arm_donning_posture(self) -> Float[np.ndarray, " freedom"]:
        """Posture of the arm in the fastened cuffs [rad], the right arm first."""
        donning = self.settings.donning
        return np.deg2rad(donning.arm_posture_deg or donning.posture_deg)

    @cached_property
    def sha256(self) -> str:
        """Hash of `rig.toml` and the URDF; every recording contains it."""
        digest = hashlib.sha256((self.folder / "rig.toml").read_bytes())
        digest.update(self.urdf_path.read_bytes())
        return digest.hexdigest()


def robots_folder() -> Path:
    """Folder of the machines of exograv: inside the installed package, or in the source tree."""
    installed = Path(__file__).parents[1] / "robots"
    return installed if installed.is_dir() else Path(__file__).parents[3] / "robots"


def rig_names() -> list[str]:
    """Names of the machines of exograv."""
    return sorted(path.parent.name for path in robots_folder().glob("*/rig.toml"))


PASSIVE_RIG, ACTIVE_RIG = "recupera_like_passive", "recupera_like"
"""Shipped machines of a session: without and with motors."""


def load_rig(rig: str, side: str | None = None) -> RigDescription:
    """Read a machine by its name, or by the path of its folder; its first side if `side` is None.

    Raises:
        ConfigError: The machine is unknown, or its `rig.toml` is invalid or has open questions.
    """
    folder = rig_folder(rig)
    path = folder / "rig.toml"
    settings = _settings(path)
    sides = settings.urdf.sides
    chosen: Side | None = next((one for one in sides if side in (None, one)), None)
    if chosen is None:
        raise ConfigError(f"{settings.name} has no side '{side}'; {path} has a URDF for: {', '.join(sides)}.")
    description = RigDescription(settings, chosen, folder)
    if not description.urdf_path.is_file():
        raise ConfigError(f"{path}: urdf.{chosen} names '{description.urdf_path.name}', which is not in {folder}.")
    return description


def rig_folder(rig: str) -> Path:
    """Find the folder of a machine by its name or path.

    Raises:
        ConfigError: The machine is unknown.
    """
    folder = Path(rig) if (Path(rig) / "rig.toml").is_file() else robots_folder() / rig
    if (folder / "rig.toml").is_file():
        return folder
    if Path(rig).is_file():
        raise ConfigError(f"{rig} is a file, and no machine. Make a machine of a URDF first: exograv rig new {rig}")
    near = difflib.get_close_matches(rig, rig_names(), n=1)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    raise ConfigError(
        f"No machine '{rig}'.{hint} Known: {', '.join(rig_names())}; or give the path of a folder with a rig.toml."
    )


def _settings(path: Path) -> RigSettings:
    try:
        text = path.read_text(encoding="utf-8")
        if questions := open_questions(text):
            raise ConfigError(
                f"{path} still asks; open questions: {len(questions)}. The first: {questions[0].sentence}. Answer each "
                f'"?" there; `exograv rig check {path.parent}` lists them all.'
            )
        return RigSettings.model_validate(tomllib.loads(text))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Check its permissions.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there.") from error


def validation_sentences(error: ValidationError) -> str:
    """Describe the findings of pydantic, one sentence each, with place and value."""
    return " ".join(map(validation_sentence, error.errors(include_url=False)))


def validation_sentence(finding: ErrorDetails) -> str:
    """Describe one finding of pydantic in a sentence, with place and value."""
    place = ".".join(str(part) for part in finding["loc"]) or "file"
    value = finding["input"]
    shown = f" (value {value!r})" if isinstance(value, (str, int, float, bool)) else ""
    return f"{place}: {finding['msg']}{shown}."
