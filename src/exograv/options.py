"""Types of options that several commands take, each with its help text and its check.

Each option is declared once, on the frozen dataclass that uses it. The command line reads these classes. A module that
declares options imports neither NumPy nor a physics engine, because `--help` must not wait for them.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

import tyro

from .errors import ConfigError

DONNINGS_MAX = 1000
SESSIONS_MAX = 99
"""Largest number of sessions of one protocol for one person."""

FLOATING_LEVEL_MAX = 1.0
"""Largest gravity level at which a relaxed arm is floated [-]. Above 1 the machine pushes the arm down, which needs the
wearer's consent in a session (docs/explanation/safety.md)."""

HEAVIEST_KG = 2.0
"""Largest weight that a person holds, and only while it is weighed [kg]."""

SIDE_HELP = "Arm; by default the first arm of the machine."
LEVEL_HELP = "Disturbances of the {}: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."


@dataclass(frozen=True)
class Within:
    """Range of allowed values, both ends included."""

    low: float | int
    high: float | int = math.inf
    allowed: str | None = None
    """End of the error message; by default the range itself."""

    unit: str = ""
    """Unit of the value in the error message."""

    def refuse(self, flag: str, value: float | int) -> None:
        """Check one value.

        Raises:
            ConfigError: The value is outside the range, or not a number.
        """
        if self.low <= value <= self.high:
            return
        raise ConfigError(f"{flag} is {value}{self.unit}; allowed: {self.range}")

    @property
    def range(self) -> str:
        """Allowed values, as the end of an error message."""
        end = "and above" if self.high == math.inf else f"to {self.high:g}"
        return f"{self.low:g} {end}." if self.allowed is None else self.allowed


@dataclass(frozen=True)
class Acts:
    """Condition under which an option has an effect. The command line refuses the option without the condition."""

    when: Callable[[Any], bool]
    """Function of all options of the command."""

    words: str
    """Condition as the end of the error message, such as 'with --simulate'."""

    def refuse(self, flag: str, value: object, options: object) -> None:
        """Check an option that was given.

        Raises:
            ConfigError: The option has no effect with the other options.
        """
        if not self.when(options):
            raise ConfigError(f"{flag} is {value}, but it acts only {self.words}. Leave it out.")


@dataclass(frozen=True)
class PersonCode:
    """Rule for the code of a person. The code must never be a name."""

    advice: str = "Give a code such as P-07, or none for a random code."
    marks: str = "-_"
    """Characters that are allowed besides letters and digits."""

    @property
    def text(self) -> str:
        """Rule as the end of an error message."""
        first, second = self.marks
        return (
            f"3 to 16 letters, digits, '{first}' and '{second}', with at least one digit: a code without a digit looks "
            "like a name"
        )

    def accepts(self, code: str) -> bool:
        """Return True if the text is a valid code of a person."""
        allowed = re.fullmatch(rf"[0-9A-Za-z{re.escape(self.marks)}]{{3,16}}", code) is not None
        return allowed and any(letter.isdigit() for letter in code)

    def refuse(self, flag: str, code: str) -> None:
        """Check one code.

        Raises:
            ConfigError: The text is not a valid code, or it looks like a name.
        """
        if not self.accepts(code):
            given = f"'{code}'" if code else "missing"
            raise ConfigError(f"{flag} is {given}; it must have {self.text}. {self.advice}")


@dataclass(frozen=True)
class Options:
    """Options of a command, or some of them. Subclasses are frozen dataclasses."""

    def __post_init__(self):
        """Check every field whose type states the allowed values.

        Raises:
            ConfigError: A value is not allowed.
        """
        for field, flag, marks in flags(type(self)):
            value = getattr(self, field)
            for mark in marks:
                if isinstance(mark, Within | PersonCode) and value is not None:
                    mark.refuse(flag, value)


def flags(kind: type) -> Iterator[tuple[str, str, tuple[Any, ...]]]:
    """Yield name, flag and marks of every option of a class whose type carries marks."""
    for field, hint in get_type_hints(kind, include_extras=True).items():
        marks = getattr(hint, "__metadata__", ())
        if marks:
            named = [mark.name for mark in marks if getattr(mark, "name", None)]
            yield field, f"--{(named or [field])[-1].replace('_', '-')}", marks


OptionRecord = dict[str, str | int | float | bool | None]
"""Options by name in a checkpoint. A run continues only with the same options."""


def foreign_world(world: "WorldName") -> OptionRecord:
    """Return the entry of a foreign world in a checkpoint. Home has none, so that earlier checkpoints continue."""
    return {} if world == "home" else {"world": world}


Side = Literal["right", "left", "both"]
"""Side of a machine. A machine for both arms is one machine."""

Sex = Literal["female", "male"]
Loss = Literal["finish", "stop"]
"""Action on an open window when no page controls the machine any more."""

WorldName = Literal["home", "tissue", "shoulder", "cuffs", "drives", "all", "unseen", "bodies"]
"""Laws of the twin: those that the estimator assumes ("home"), or foreign ones."""

Bus = Literal["canopen", "moteus", "udp"]
Profile = Literal["harmonic", "qdd"]

RIG_HELP = "Machine: a name (see `exograv rigs`), or the path of its folder."
RigArgument = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="[RIG]", help=RIG_HELP)]
"""Machine that a command acts on: always the first word after the command. `--rig NAME` is another spelling."""

DerivedMachine = Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[RIG]", help=RIG_HELP)]
"""Machine of a command whose default depends on other options."""

SIMULATE_HELP = (
    "Use no hardware: simulated drives in another process, with the twin behind them, take the place of the machine's "
    "own."
)
Simulate = Annotated[bool, tyro.conf.arg(help=SIMULATE_HELP)]
ON_SIMULATED = Acts(lambda all_: all_.drives is None or all_.simulate, "on a simulated machine, not on real drives")
ON_DRIVES = Acts(lambda all_: all_.is_on_drives, "with --drives or --simulate")
ON_TWIN = Acts(lambda all_: not all_.is_on_drives, "on the twin, without --drives and --simulate")
SideOption = Annotated[Side | None, tyro.conf.arg(help=SIDE_HELP)]
OneSideOption = Annotated[Literal["right", "left"] | None, tyro.conf.arg(help=SIDE_HELP)]
Level = Annotated[int, Within(0, 4, "0 (none) to 4 (a bad day)."), tyro.conf.arg(help=LEVEL_HELP.format("twin"))]
World = Annotated[
    WorldName,
    tyro.conf.arg(
        help="Laws of the twin: those of the estimator's model (home), or foreign ones of tissue, shoulder, cuffs, "
        "drives or all of them; other published laws (unseen); another anthropometric sample (bodies). A level changes "
        "sizes, a world changes laws."
    ),
]
TwinName = Literal["drawn", "fitted"]
"""Machine of the twin: drawn from usual values of its kind, or from its own file twin.toml."""

TwinSource = Annotated[
    TwinName,
    tyro.conf.arg(
        name="twin",
        help="Machine of the twin: drawn from usual values of such machines, or fitted: drawn from the posterior in "
        "the twin.toml of the machine's folder (`exograv twin fit`).",
    ),
]
AnySeed = Annotated[int, tyro.conf.arg(help="Seed of machine, wearer and run; the same seed gives the same figures.")]
Seed = Annotated[AnySeed, Within(0)]
Processes = Annotated[int, Within(1, 64)]
Donning = Annotated[
    int,
    Within(0, DONNINGS_MAX, f"0 (the first) to {DONNINGS_MAX}."),
    tyro.conf.arg(
        help="Number of the donning by the twin's wearer: 0 is the first, 1 is the same person in cuffs put on anew."
    ),
]
CalibrationFile = Annotated[
    Path | None,
    tyro.conf.arg(help="File calibration.toml of this machine (`exograv rig calibrate`); calibrated first if absent."),
]
Repeated = Annotated[tuple[str, ...], tyro.conf.UseAppendAction]
"""Flag that can be repeated."""

StreamNames = Annotated[Repeated, tyro.conf.arg(name="record-stream", metavar="NAME")]
SegmentLengths = Annotated[Repeated, tyro.conf.arg(name="length", metavar="SEGMENT=M")]
JointNames = Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")]
JointFactors = Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT:FACTOR")]
DrivesFile = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
GravityLevel = Annotated[
    float, Within(0.0, FLOATING_LEVEL_MAX, "0 (weightless) to 1 (Earth). The Moon is 0.165, Mars 0.38.")
]
HeldWeight = Within(0.0, HEAVIEST_KG, f"0 (none) to {HEAVIEST_KG:g} kg. Take a lighter one.", " kg")


@dataclass(frozen=True)
class SeedOption(Options):
    """Seed of a command that draws something else than a twin."""

    seed: Seed = 0


@dataclass(frozen=True)
class TwinOptions(Options):
    """Options of a command that runs on the twin."""

    rig: RigArgument = "recupera_like"
    side: SideOption = None
    level: Level = 2
    world: World = "home"
    seed: Seed = 0


@dataclass(frozen=True)
class MachineOptions(TwinOptions):
    """Options of a command for the twin or a machine on drives. Each subclass states the tests its drives must pass."""

    level: Annotated[Level, ON_SIMULATED] = 2
    world: Annotated[World, ON_SIMULATED] = "home"
    seed: Annotated[Seed, ON_SIMULATED] = 0

    drives: DrivesFile = None
    """File drives.toml of a real machine."""

    simulate: Simulate = False

    twin: Annotated[TwinSource, Acts(lambda all_: all_.simulate, "with --simulate")] = "drawn"

    @property
    def is_on_drives(self) -> bool:
        """True if the machine is connected by a bus, real or simulated."""
        return self.drives is not None or self.simulate


@dataclass(frozen=True)
class CalibratedOptions(MachineOptions):
    """Options of a command that reads or writes the calibration of a machine."""

    calibration: Path | None = None
    """File of the calibration; by default calibration.toml in the folder of `--out`."""

    def calibration_in(self, folder: Path) -> Path:
        """Path of the calibration file; by default `calibration.toml` in `folder`."""
        return self.calibration or folder / "calibration.toml"


@dataclass(frozen=True)
class WornOptions(CalibratedOptions):
    """Options of a command that moves a person's arm in a machine, or that of the twin's wearer."""

    drives: DrivesFile = None
    """File drives.toml of a real machine with a wearer, which passed its self-test on this computer today."""

    real_time: Annotated[bool, Acts(lambda all_: all_.simulate, "with --simulate")] = False
    """Let simulated drives keep their own time, as real drives do: a pause of this computer then stops the machine.
    Otherwise they wait for this computer."""

    @property
    def waits(self) -> bool:
        """True if the drives are simulated, and wait for this computer."""
        return self.simulate and not self.real_time


def text_option(read: Callable[[str], Any], write: Callable[[Any], str], metavar: str) -> Any:
    """Mark of an option that is read from one word."""
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda words: read(words[0]),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [write(value)],
    )


def read_numbers(text: str, flag: str) -> list[float]:
    """Numbers separated by commas.

    Raises:
        ConfigError: A value is not a number.
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise ConfigError(f"{flag} is '{text}'; give numbers separated by commas, without spaces.") from error


def read_pair(text: str, flag: str) -> tuple[int, int]:
    """Two integers separated by a comma.

    Raises:
        ConfigError: The text is not two integers separated by a comma.
    """
    values = read_numbers(text, flag)
    if len(values) != 2 or any(value != int(value) for value in values):
        raise ConfigError(f"{flag} is '{text}'; give two integers, such as 3,3.")
    return int(values[0]), int(values[1])


def pair(flag: str) -> Any:
    """Mark of an option that holds two integers."""
    return text_option(lambda text: read_pair(text, flag), lambda both: ",".join(map(str, both)), "A,B")


def words(read: Callable[[str], tuple[Any, ...]]) -> Any:
    """Mark of an option that holds words or numbers separated by commas."""
    return text_option(read, lambda several: ",".join(map(str, several)), "STR")


def _read_named(texts: list[str]) -> dict[str, float]:
    return dict(_named_number(text, "--constant") for text in texts)


def _named_number(text: str, flag: str) -> tuple[str, float]:
    """Name and number of a text NAME=VALUE.

    Raises:
        ConfigError: The text is not NAME=VALUE with a number.
    """
    name, equals, value = text.partition("=")
    try:
        if not equals:
            raise ValueError
        return name.strip(), float(value)
    except ValueError:
        raise ConfigError(f"{flag} is '{text}'; give NAME=VALUE with a number, such as width=0.1.") from None


NamedNumbers = Annotated[
    Mapping[str, float],
    tyro.conf.arg(name="constant"),
    tyro.constructors.PrimitiveConstructorSpec(
        nargs="*",
        metavar="[STR [STR ...]]",
        instance_from_str=_read_named,
        is_instance=lambda value: isinstance(value, Mapping),
        str_from_instance=lambda value: [f"{name}={number:g}" for name, number in value.items()],
    ),
]
"""Constants by name, each as NAME=VALUE."""


OUT = Path("out")
"""Folder of `--out` if none is given."""
