"""Options of the tools for a machine's files."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import AnySeed, Options, RigOption, Seed, Sex, Side, SideOption, Within, read_numbers, words
from exograv.procedures.identification.method_names import MethodName

PERIOD_S = (5.0, 120.0)
FASTEST_HZ = 0.6  # a harmonic faster than this would lie too near the sample filter's corner


@dataclass(frozen=True)
class NewRigOptions:
    """Options of `exograv new-rig`."""

    urdf: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """The machine's description; it is copied, without its pictures and collision shapes."""

    out: Path = Path()
    """Folder to write, which must not exist; called like the robot, in this folder, if none is named."""

    side: Side | None = None
    """Which arm it is for; by the names in the URDF if not given."""


@dataclass(frozen=True)
class CheckOptions:
    """Options of `exograv check-rig`."""

    rig: Annotated[str, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder with a rig.toml, or name of a machine (see `exograv rigs`)."""

    side: Side | None = None
    """Arm that is put in; the machine's first if none is named."""

    height_m: float = 1.75
    """Of the wearer whose arm is put in [m]."""

    mass_kg: float = 75.0
    """Of the wearer [kg]."""

    sex: Sex = "male"
    """Of the wearer: which table the arm is taken from."""


@dataclass(frozen=True)
class DesignOptions(Options):
    """Options of `exograv design-motion`."""

    rig: tyro.conf.Positional[RigOption] = "recupera_like"
    side: SideOption = None

    height_m: float = 1.70
    """Of the person it is designed for [m]."""

    mass_kg: float = 70.0
    """Of that person [kg]."""

    sex: Sex = "female"
    """By which table."""

    seconds: float = 300.0
    """How long to search [s]; what is not reached by then is left out, and the result may differ between computers."""

    period_s: Annotated[float, Within(*PERIOD_S, f"{PERIOD_S[0]:g} to {PERIOD_S[1]:g} s.")] = 30.0
    """After which the motion repeats itself [s]."""

    harmonics: int = 8
    """Of that period."""

    starts: int = 4
    """Random starts beside the machine's present motion: loops, and motions that come back the way they went."""

    iterations: tyro.conf.Fixed[int] = 120
    """Of each start."""

    seed: Seed = 0

    def __post_init__(self):
        super().__post_init__()
        most = int(FASTEST_HZ * self.period_s)
        if not 1 <= self.harmonics <= most:
            raise ConfigError(
                f"--harmonics is {self.harmonics}; allowed with a period of {self.period_s:g} s: 1 to {most}, "
                f"so that none is faster than {FASTEST_HZ:g} Hz."
            )
        if self.seconds <= 0.0 or self.starts < 1:
            raise ConfigError(f"--seconds {self.seconds:g} and --starts {self.starts} must be positive.")


@dataclass(frozen=True)
class ExportOptions:
    """Options of `exograv export-urdf`."""

    participant: Path = Path("participant.toml")
    """File that `exograv identify --keep` has written."""

    calibration: Path | None = None
    """calibration.toml of the machine, for its links; without it they are those of its description."""

    rig: str | None = None
    """Folder of the machine, if it is not a built-in one."""


@dataclass(frozen=True)
class LogOptions:
    """Options of `exograv identify-log`."""

    log: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recorded with the payload: CSV with time [s], positions [rad], velocities [rad/s], currents [A]; no more."""

    unloaded: Path = field(default=tyro.MISSING)
    """The same robot without the payload."""

    urdf: Path = field(default=tyro.MISSING)
    """Description of the robot."""

    payload_frame: str = field(default=tyro.MISSING)
    """Link or frame that carries the payload."""

    gains: Annotated[Sequence[float], words(lambda text: tuple(read_numbers(text, "--gains")))] = field(
        default=tyro.MISSING
    )
    """Joint torque per motor current [N·m/A], one a joint, separated by commas."""

    true_kg: float | None = None
    """The payload's mass, if it is known: then the time until the estimate stays within 10 % is reported."""

    method: MethodName = "recursive"
    """How the payload is identified."""

    rows: str | None = None
    """First and last row of the log to use, counted from 1, as a:b; without it the log is cut to the motion."""

    rows_unloaded: str | None = None
    """The same for the unloaded log."""

    gain_sd: float = 0.0
    """Standard deviation of the gains, as a share; widens the interval."""

    seed: AnySeed = 0
    """Without effect: nothing is drawn here. Every command takes one."""
