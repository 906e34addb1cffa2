"""Options of the comparison of identification methods."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, cast, get_args

import tyro

from exograv.errors import ConfigError
from exograv.options import Options, Processes, Profile, Within, World, words
from exograv.procedures.identification.method_names import MethodName

MOTION_S = 120.0
FINALISTS = ("recursive", "gradient", "gradient-full")
"""Methods that also run in closed loop: ours, and the paper's method with its own model and with our model."""


def methods_of(text: str) -> tuple[MethodName, ...]:
    """Parse names of methods, separated by commas.

    Raises:
        ConfigError: A name is unknown or is given twice.
    """
    return cast(tuple[MethodName, ...], _known(text, "--methods", get_args(MethodName)))


def profiles_of(text: str) -> tuple[Profile, ...]:
    """Parse kinds of drive, separated by commas.

    Raises:
        ConfigError: A kind is unknown or is given twice.
    """
    return cast(tuple[Profile, ...], _known(text, "--profiles", get_args(Profile)))


def levels_of(text: str) -> tuple[int, ...]:
    """Parse disturbance levels, separated by commas.

    Raises:
        ConfigError: A level is unknown or is given twice.
    """
    return tuple(map(int, _known(text, "--levels", ("0", "1", "2", "3", "4"))))


def _known(text: str, option: str, known: Sequence[str]) -> tuple[str, ...]:
    given = tuple(text.split(","))
    for one in given:
        if one not in known:
            raise ConfigError(f"{option} has '{one}'; known: {', '.join(known)}. Separate them by commas, no spaces.")
        if given.count(one) > 1:
            raise ConfigError(f"{option} has '{one}' twice; name each once.")
    return given


@dataclass(frozen=True)
class BenchmarkOptions(Options):
    """Options of `exograv dev benchmark-identification`."""

    wearers: Annotated[int, Within(0, 1000)] = 3
    """Number of wearers in closed loop, where the estimate drives the arm (finalists only)."""

    streams: Annotated[int, Within(0, 1000)] = 3
    """Number of recorded streams; every method processes the same ones."""

    levels: Annotated[tuple[int, ...], words(levels_of)] = (2,)
    """Disturbance levels by commas, 0 (none) to 4 (worst)."""

    world: World = "home"

    profiles: Annotated[tuple[Profile, ...], words(profiles_of)] = ("harmonic",)
    """Kinds of drive by commas: harmonic, qdd."""

    methods: Annotated[tuple[MethodName, ...], words(methods_of)] = get_args(MethodName)
    """Methods by commas; all of them if absent."""

    seed_from: Annotated[int | None, Within(0, allowed="0 and above. Tune from 1000 on, report from 0.")] = None
    """Seed of the first wearer, `--seed` if absent; the others follow it. Tune from 1000 on, report from 0."""

    only: str | None = None
    """Disturbance that is alone at the level, with all others at level 0."""

    without: str | None = None
    """Disturbance that is switched off."""

    never_relaxed: bool = False
    """True for wearers who never relax: their muscles are restless as at level 4, all else stays at the level."""

    break_down: Literal["without", "only"] | None = None
    """Breakdown of left over: each disturbance in turn switched off, or alone. Open loop only."""

    processes: Processes = 1
    """Number of parallel processes; update times are comparable only with a free core for each."""

    resume: bool = False
    """Continue with the runs in the folder of `--out`."""

    seconds: tyro.conf.Fixed[float] = MOTION_S
    """Duration of the motion [s]; only tests use less than the default."""

    def __post_init__(self):
        super().__post_init__()
        if self.wearers + self.streams == 0:
            raise ConfigError("--wearers and --streams are both 0; nothing would run. Give one of them 1 or more.")
        if sum(one is not None for one in (self.only, self.without, self.break_down)) > 1:
            raise ConfigError("--only, --without and --break-down exclude each other; give one of them.")
        _refuse_unknown_rows(self)
        if self.break_down is not None and self.streams == 0:
            raise ConfigError("--break-down compares open-loop streams; --streams is 0. Give it 1 or more.")
        if self.break_down is not None and (self.never_relaxed or len(self.levels) > 1):
            raise ConfigError("--break-down takes one level and no --never-relaxed. Run it once for each.")

    @property
    def first_seed(self) -> int:
        """Seed of the first wearer."""
        return self.seed_from or 0

    @property
    def closed_loop_methods(self) -> tuple[MethodName, ...]:
        """Methods that run in closed loop; none with `break_down`, which uses streams only."""
        return tuple(name for name in self.methods if name in FINALISTS and self.break_down is None)


def _refuse_unknown_rows(options: BenchmarkOptions) -> None:
    if (options.only, options.without) == (None, None):
        return
    from exograv.rig.twin.disturbances.levels import ROWS  # The import loads the twin.

    for name, row in (("--only", options.only), ("--without", options.without)):
        if row is not None and row not in ROWS:
            raise ConfigError(f"{name} names no disturbance '{row}'; known: {', '.join(ROWS)}.")
