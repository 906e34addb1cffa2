"""Options of the commands that run on the twin alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from exograv.options import (
    HEAVIEST_KG,
    Bus,
    CalibrationFile,
    Donning,
    GravityLevel,
    JointFactors,
    JointNames,
    Level,
    OneSideOption,
    Options,
    RigOption,
    Seed,
    SideOption,
    TwinOptions,
    Within,
)
from exograv.procedures.identification.method_names import MethodName, MotionName, TorqueSourceName

MovementName = Literal["pointing", "recorded"]
Kilograms = tyro.conf.arg(metavar="KG")
HeldWeight = Within(0.0, HEAVIEST_KG, f"0 (none) to {HEAVIEST_KG:g} kg. Take a lighter one.", " kg")


@dataclass(frozen=True)
class DemoOptions(Options):
    """Options of `exograv demo` and `exograv arm identify`."""

    rig: RigOption = "recupera_like"
    side: SideOption = None
    level: Level = 2

    method: MethodName = "recursive"
    """How the arm is identified: ours, the paper's, or the table alone."""

    gravity_level: GravityLevel = 0.0
    """Felt share of the arm's own weight: 0 weightless, 0.165 Moon, 0.378 Mars, 1 Earth."""

    seed: Seed = 0

    seconds: Annotated[float, Within(5.0, 600.0, "5 to 600 s of motion.")] = 60.0
    """Motion that the arm is identified from [s]."""

    motion: MotionName = "designed"
    """What moves the arm meanwhile: the machine's own motion, pieces planned from what is uncertain, or others'."""

    torque_source: TorqueSourceName = "current"
    """What counts as real torque: motor current, or what was commanded."""

    realtime: bool = False
    """Show it at the pace of life."""

    only_identify: tyro.conf.Fixed[bool] = False
    """Leave out floating and the known weight."""

    wearer_model: str | None = None
    """MJCF or URDF of a third party's arm that is the truth in place of a drawn one; needs `--wearer-map`."""

    wearer_map: str | None = None
    """TOML file that says what the model's bodies and joints are (docs/howto/wearer_models.md)."""

    calibration: CalibrationFile = None
    donning: Donning = 0


@dataclass(frozen=True)
class WeighOptions(TwinOptions):
    """Options of `exograv arm weigh`."""

    hand_weight_kg: Annotated[float | None, tyro.conf.arg(name="hand-weight", metavar="KG"), HeldWeight] = None
    """Weight that the virtual wearer takes into the hand [kg], hidden from the software; drawn if none is given, 0 for
    none."""

    forearm_weight_kg: Annotated[float, tyro.conf.arg(name="forearm-weight", metavar="KG"), HeldWeight] = 0.0
    """The same at the middle of the forearm [kg]."""

    body_mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG")] = None
    """Body mass as the operator typed it [kg]; the wearer's own if none is given."""

    calibration: CalibrationFile = None


@dataclass(frozen=True)
class TransparencyOptions(Options):
    """Options of `exograv dev transparency`."""

    rig: Annotated[
        str | None,
        tyro.conf.arg(
            help="Name of a machine (see `exograv rigs`) or path of its folder; harmonic and quasi-direct drives side "
            "by side if none is named."
        ),
    ] = None
    side: OneSideOption = None
    level: Level = 2
    seed: Seed = 0

    machines: Annotated[int, Within(1, 100, "1 to 100. Goals are judged by at least 5.")] = 5
    """Machines and wearers, drawn from `seed` and the seeds after it."""

    movement: MovementName = "pointing"
    """Eight touches of a screen, or reaching as recorded from people (docs/explanation/transparency.md says where to
    get it)."""


@dataclass(frozen=True)
class DriveSimOptions(Options):
    """Options of `exograv dev drive-sim`."""

    bus: tyro.conf.Positional[Bus] = "udp"
    """On which they are reached."""

    rig: RigOption = "recupera_like"
    side: SideOption = None

    drives: Path | None = None
    """drives.toml of the machine, with this bus; without, one is written into the folder drive_sim of --out."""

    level: Level = 0
    seed: Seed = 0

    worn: bool = False
    """With its wearer, in the posture in which it is put on; without, it hangs empty."""

    lock_step: bool = False
    """Step by one period of the loop with each measurement, faster or slower than real time."""

    wrong_sign: JointNames = ()
    """Joints whose motor turns the other way."""

    wrong_scale: JointFactors = ()
    """Joints whose motor gives so many times the torque."""

    wrong_encoder: JointNames = ()
    """Joints whose encoder counts the other way."""
