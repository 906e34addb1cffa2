"""Options of the commands that run on the twin alone."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

import tyro

from exograv.options import (
    ON_SIMULATED,
    ON_TWIN,
    RIG_HELP,
    Acts,
    Bus,
    DerivedMachine,
    Donning,
    GravityLevel,
    JointFactors,
    JointNames,
    Level,
    OneSideOption,
    Options,
    RigArgument,
    Seed,
    SideOption,
    TwinSource,
    Within,
    World,
    WornOptions,
)
from exograv.procedures.identification.method_names import (
    MethodName,
    MotionName,
    TorqueSourceName,
    refuse_without_uncertainty,
)
from exograv.procedures.rehabilitation.support_level.options import Synergy

WORN_AND_RELAXED = Acts(lambda all_: all_.worn and all_.person == "relaxed", "with --worn and without --person")
OF_WEAK = Acts(lambda all_: all_.person == "weak", "with --person weak")
MovementName = Literal["pointing", "recorded"]
Kilograms = tyro.conf.arg(metavar="KG")


@dataclass(frozen=True)
class IdentifyOptions(Options):
    """Options of `exograv arm identify`."""

    rig: RigArgument = "recupera_like"
    side: SideOption = None
    level: Level = 2
    world: World = "home"
    twin: TwinSource = "drawn"

    method: MethodName = "recursive"
    """Method that identifies the arm: ours, the paper's, or the table alone."""

    seed: Seed = 0

    seconds: Annotated[float, Within(5.0, 600.0, "5 to 600 s of motion.")] = 60.0
    """Duration of the motion for the identification [s]."""

    motion: MotionName = "designed"
    """Motion of the arm for the identification: the machine's own, pieces planned from the uncertainty, or others."""

    torque_source: TorqueSourceName = "current"
    """Source of the real torque: motor current, or the commanded torque."""

    realtime: bool = False
    """Run at real-time speed."""

    wearer_model: str | None = None
    """MJCF, URDF or OpenSim model of a third party's arm that replaces the drawn one as the truth."""

    wearer_map: Annotated[str | None, Acts(lambda all_: all_.wearer_model is not None, "with --wearer-model")] = None
    """TOML file that assigns the model's bodies and joints (docs/howto/wearer_models.md).

    An OpenSim model whose names are known needs none.
    """

    calibration: Annotated[
        Path | None,
        tyro.conf.arg(
            help="File calibration.toml of this machine (`exograv rig calibrate`), or `auto`: the calibration that an "
            "earlier run with `auto` has kept; calibrated first if absent."
        ),
    ] = None

    donning: Donning = 0

    def __post_init__(self):
        super().__post_init__()
        if self.motion == "adaptive":
            refuse_without_uncertainty("--motion adaptive", self.method)


@dataclass(frozen=True)
class ArmOptions(IdentifyOptions, WornOptions):
    """Options of `exograv arm identify` on the twin or on drives."""

    level: Annotated[Level, ON_SIMULATED] = 2
    world: Annotated[World, ON_SIMULATED] = "home"
    seed: Annotated[Seed, ON_SIMULATED] = 0
    twin: Annotated[TwinSource, ON_SIMULATED] = "drawn"

    method: Annotated[MethodName, ON_TWIN] = "recursive"
    """Method that identifies the arm: ours, the paper's, or the table alone. On drives it is always ours."""

    motion: Annotated[MotionName, ON_TWIN] = "designed"
    """Motion of the arm for the identification: the machine's own, pieces planned from the uncertainty, or others."""

    torque_source: Annotated[TorqueSourceName, ON_TWIN] = "current"
    """Source of the real torque: motor current, or the commanded torque."""

    realtime: Annotated[bool, ON_TWIN] = False
    """Run at real-time speed. Drives have no other speed."""

    wearer_model: Annotated[str | None, ON_TWIN] = None
    """MJCF, URDF or OpenSim model of a third party's arm that replaces the drawn one as the truth."""

    donning: Annotated[Donning, ON_TWIN] = 0

    calibration: Annotated[
        Path | None,
        tyro.conf.arg(
            help="File calibration.toml of this machine (`exograv rig calibrate`). Without it the twin is calibrated "
            "first, with `auto` once for all runs; on drives it is the file in the folder of --out."
        ),
    ] = None

    @property
    def on_twin(self) -> IdentifyOptions:
        """Options of the same identification on the twin."""
        return IdentifyOptions(**{one.name: getattr(self, one.name) for one in fields(IdentifyOptions)})


@dataclass(frozen=True)
class DemoOptions(IdentifyOptions):
    """Options of `exograv demo`."""

    gravity_level: GravityLevel = 0.0
    """Felt share of the arm's own weight: 0 weightless, 0.165 Moon, 0.38 Mars, 1 Earth."""

    only_identify: tyro.conf.Fixed[bool] = False
    """Omit floating and the known weight."""


@dataclass(frozen=True)
class TransparencyOptions(Options):
    """Options of `exograv dev transparency`."""

    rig: Annotated[DerivedMachine, tyro.conf.arg(help=f"{RIG_HELP} Default: one with each kind of drive.")] = None
    side: OneSideOption = None
    level: Level = 2
    world: World = "home"
    twin: TwinSource = "drawn"
    seed: Seed = 0

    machines: Annotated[int, Within(1, 100, "1 to 100. Goals are judged by at least 5.")] = 5
    """Number of machines and wearers, drawn from `seed` and the seeds after it."""

    movement: MovementName = "pointing"
    """Eight touches of a screen, or recorded reaching of people (docs/explanation/transparency.md has the source)."""


@dataclass(frozen=True)
class DriveSimOptions(Options):
    """Options of `exograv dev drive-sim`."""

    rig: RigArgument = "recupera_like"

    bus: Bus = "udp"
    """Bus of the drives."""

    side: SideOption = None

    drives: Path | None = None
    """File drives.toml of the machine, with this bus. Without it, one is written into the folder drive_sim of --out."""

    level: Level = 0
    world: World = "home"
    twin: TwinSource = "drawn"
    seed: Seed = 0

    worn: bool = False
    """Put the wearer into the machine, in the donning posture. Without it the machine hangs empty."""

    person: Literal["relaxed", "virtual", "weak"] = "relaxed"
    """Wearer of `--worn`: relaxed; a virtual participant who also points at the screen of a session; or a weak person
    who follows instructions at the bench."""

    strength: Annotated[float | None, OF_WEAK] = None
    """Strength of the weak person, relative to a healthy adult; 0.1 without this option and without a file."""

    synergy: Annotated[Synergy, OF_WEAK] = None

    person_file: Annotated[Path | None, OF_WEAK] = None
    """TOML file of the weak person (docs/howto/support_level.md)."""

    dummy: Annotated[Path | None, WORN_AND_RELAXED, tyro.conf.arg(metavar="FILE")] = None
    """File of a dummy arm that takes the place of the wearer (docs/howto/accept.md)."""

    protocol: str = "training"
    """Protocol of the session, with its target and pace, for `--person virtual`."""

    donning: Donning = 0

    run: Annotated[int, Within(0, 2**31)] = 0
    """Number of the run with `--person virtual`: another number draws other noise and muscles."""

    line: Annotated[int, Within(0, 65535)] = 0
    """TCP port of the line between `--person virtual` and the session; 0 for a free port."""

    lock_step: bool = False
    """Advance by one period of the loop with each measurement, instead of real time."""

    ends_with_input: bool = False
    """End when the standard input ends, so that the drives end with the program that has started them."""

    wrong_sign: JointNames = ()
    """Joints with a motor that turns the wrong way."""

    wrong_scale: JointFactors = ()
    """Joints with a motor that gives this multiple of the torque."""

    wrong_encoder: JointNames = ()
    """Joints with an encoder that counts the wrong way."""


@dataclass(frozen=True)
class StimulusOptions(Options):
    """Options of `exograv dev stimulus`."""

    link: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="LINK")] = tyro.MISSING
    """Link that `exograv run train --simulate --stimulus PORT` shows for the participant's screen."""

    line: Annotated[int, Within(1024, 65535), tyro.conf.arg(metavar="PORT")] = tyro.MISSING
    """TCP port at which the virtual participant waits: the PORT of that command."""

    chromium: Path = Path("/usr/bin/chromium")
    """Program of the browser."""

    amplifier: Annotated[int | None, Within(1024, 65535), tyro.conf.arg(metavar="PORT")] = None
    """UDP port of `exograv dev amplifier`: each touch is a pulse on its trigger channel, and its EMG electrodes are on
    the participant."""

    memory: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File with the skill of the participant: read at the start if it is there, written at the end. A later session of
    the same participant then continues the learning."""


@dataclass(frozen=True)
class AmplifierOptions(Options):
    """Options of `exograv dev amplifier`."""

    port: Annotated[int, Within(1024, 65535)] = 47300
    """UDP port for the pulses and for the torque of the muscles, the PORT of `exograv dev stimulus --amplifier`."""

    seconds: Annotated[float | None, tyro.conf.arg(metavar="S"), Within(1.0, 86_400.0)] = None
    """Duration [s]; without it until Ctrl-C."""

    channels: Annotated[int, Within(1, 32)] = 4
    """Number of EMG channels, one per freedom of the arm."""

    seed: Annotated[int, Within(0)] = 0
    """Seed of the signals."""
