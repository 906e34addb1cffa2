"""Options of the tools for a machine's files."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import (
    RIG_HELP,
    DerivedMachine,
    Options,
    RigArgument,
    Seed,
    Sex,
    Side,
    SideOption,
    Within,
    read_numbers,
    words,
)
from exograv.procedures.identification.method_names import MethodName

PERIOD_S = (5.0, 120.0)
FASTEST_HZ = 0.6  # faster harmonics would be too near the sample filter's corner


@dataclass(frozen=True)
class NewRigOptions:
    """Options of `exograv rig new`."""

    urdf: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """URDF or MJCF of the machine. It is copied as URDF without its pictures and collision shapes."""

    out: Path = Path()
    """Folder to write, which must not exist; named after the robot, in this folder, if none is given."""

    side: Side | None = None
    """Arm that the machine is for; taken from the names in the file if not given. In a file with two arms, the arm that
    is written."""

    wearer_links: str | None = None
    """Answer for links that look like a human arm: leave-out if they are the wearer's, keep if they are the machine's,
    or the names of the wearer's links, separated by commas."""

    joints: Annotated[Sequence[str], words(lambda text: tuple(text.split(",")))] = ()
    """Joints that move the arm, separated by commas, in place of the inferred ones; every other joint is fixed."""

    elbow: Annotated[Sequence[str], words(lambda text: tuple(text.split(",")))] = ()
    """Joint of the elbow, if the names of the joints do not tell it; of two arms both, separated by commas."""


@dataclass(frozen=True)
class CheckOptions:
    """Options of `exograv rig check`."""

    rig: RigArgument = "recupera_like"

    side: Side | None = None
    """Arm that is put in; the machine's first if none is named."""

    height_m: float = 1.75
    """Height of the wearer whose arm is put in [m]."""

    mass_kg: float = 75.0
    """Body mass of the wearer [kg]."""

    sex: Sex = "male"
    """Sex of the wearer, which selects the table of the arm."""


@dataclass(frozen=True)
class DesignOptions(Options):
    """Options of `exograv rig motion`."""

    rig: RigArgument = "recupera_like"
    side: SideOption = None

    height_m: float = 1.70
    """Height of the person that the motion is designed for [m]."""

    mass_kg: float = 70.0
    """Body mass of that person [kg]."""

    sex: Sex = "female"
    """Sex of that person, which selects the table of the arm."""

    seconds: Annotated[float, Within(1.0, 86_400.0, "1 to 86400 s.")] = 300.0
    """Duration of the search [s]. Starts that are not begun by then are left out, so the result may differ between
    computers."""

    period_s: Annotated[float, Within(*PERIOD_S, f"{PERIOD_S[0]:g} to {PERIOD_S[1]:g} s.")] = 30.0
    """Period of the motion [s]."""

    harmonics: int = 8
    """Harmonics of that period."""

    write: tyro.conf.FlagCreatePairsOff[bool] = False
    """Put the block into the machine's rig.toml in place of its [excitation]."""

    starts: Annotated[int, Within(1, 1000)] = 4
    """Random starts beside the machine's present motion: loops, and motions that return on the same path."""

    iterations: tyro.conf.Fixed[int] = 120
    """Iterations of each start."""

    seed: Seed = 0

    def __post_init__(self):
        super().__post_init__()
        most = int(FASTEST_HZ * self.period_s)
        if not 1 <= self.harmonics <= most:
            raise ConfigError(
                f"--harmonics is {self.harmonics}; allowed with a period of {self.period_s:g} s: 1 to {most}, "
                f"so that none is faster than {FASTEST_HZ:g} Hz."
            )


@dataclass(frozen=True)
class ExportOptions:
    """Options of `exograv rig export`."""

    participant: Path = Path("participant.toml")
    """File that `exograv arm identify --keep` has written."""

    calibration: Path | None = None
    """File calibration.toml of the machine, for its links; without it the links are those of its description."""

    rig: Annotated[DerivedMachine, tyro.conf.arg(help=f"{RIG_HELP} Default: the machine of the file.")] = None


@dataclass(frozen=True)
class LogOptions:
    """Options of `exograv arm identify-log`."""

    log: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Log with the payload: CSV (time [s], positions [rad], velocities [rad/s], currents [A] or torques [N·m]), or the
    joint states of a ROS recording (MCAP, folder of a ROS 2 bag)."""

    unloaded: tuple[Path, ...] = field(default=tyro.MISSING)
    """Logs of the same robot without the payload, one or more; several logs also show how its friction changes."""

    urdf: Path = field(default=tyro.MISSING)
    """URDF of the robot."""

    payload_frame: str = field(default=tyro.MISSING)
    """Link or frame that carries the payload."""

    gains: Annotated[Sequence[float], words(lambda text: tuple(read_numbers(text, "--gains")))] = ()
    """Joint torque per motor current [N·m/A], one per joint, separated by commas; or give --torque."""

    torque: bool = False
    """The logs contain joint torques [N·m] in place of currents."""

    columns: str | None = None
    """Columns of CSV logs: four words for time, positions, velocities and efforts. 1,2,8,14 are their first columns;
    t,q*,v*,i* are names of a header, where * is the joint's name or number. Without it: usual names, or this order."""

    true_kg: float | None = None
    """Known mass of the payload [kg]: the time until the estimate stays within 10 % is then reported."""

    method: MethodName = "recursive"
    """Identification method of the payload."""

    rows: str | None = None
    """First and last row of the log to use, counted from 1, as a:b; without it the log is cut to the motion."""

    rows_unloaded: str | None = None
    """First and last row of each unloaded log to use, as --rows; separated by commas."""

    gain_sd: float = 0.0
    """Standard deviation of an error that all gains share, as a share; widens the interval."""
