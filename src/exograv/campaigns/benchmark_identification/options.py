"""Options of the comparison of identification methods."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, cast, get_args

import tyro

from exograv.errors import ConfigError
from exograv.options import Options, Processes, Profile, Within, words
from exograv.procedures.identification.method_names import MethodName

MOTION_S = 120.0
FINALISTS = ("recursive", "gradient", "gradient-full")
"""Flown in closed loop too: ours, and the paper's method with its own model and with ours."""


def methods_of(text: str) -> tuple[MethodName, ...]:
    """Methods by their names with commas between them.

    Raises:
        ConfigError: One is unknown, or named twice.
    """
    return cast(tuple[MethodName, ...], _known(text, "--methods", get_args(MethodName)))


def profiles_of(text: str) -> tuple[Profile, ...]:
    """Kinds of drive in the same way.

    Raises:
        ConfigError: One is unknown, or named twice.
    """
    return cast(tuple[Profile, ...], _known(text, "--profiles", get_args(Profile)))


def levels_of(text: str) -> tuple[int, ...]:
    """Disturbance levels in the same way.

    Raises:
        ConfigError: One is unknown, or named twice.
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
    """Options of `exograv benchmark-identification`."""

    wearers: Annotated[int, Within(0, 1000)] = 3
    """Wearers in closed loop, where the estimate drives the arm (finalists only)."""

    streams: Annotated[int, Within(0, 1000)] = 3
    """Recorded streams that every method meets alike."""

    levels: Annotated[tuple[int, ...], words(levels_of)] = (2,)
    """Disturbance levels by commas, 0 (none) to 4 (a bad day)."""

    profiles: Annotated[tuple[Profile, ...], words(profiles_of)] = ("harmonic",)
    """Kinds of drive by commas: harmonic, qdd."""

    methods: Annotated[tuple[MethodName, ...], words(methods_of)] = get_args(MethodName)
    """Methods by commas; all if absent."""

    seed_from: Annotated[int | None, Within(0, allowed="0 and above. Tune from 1000 on, report from 0.")] = None
    """Seed of the first wearer, `--seed` if absent; the others follow it. Tune from 1000 on, report from 0."""

    only: str | None = None
    """One disturbance at the level, all others at level 0."""

    without: str | None = None
    """One disturbance switched off."""

    never_relaxed: bool = False
    """Wearers who never let go: their muscles stir as at level 4, all else stays at the level."""

    break_down: Literal["without", "only"] | None = None
    """Every disturbance in turn switched off, or alone: what the remainder is made of. Open loop only."""

    processes: Processes = 1
    """At the same time; update times are fair only with a free core for each."""

    resume: bool = False
    """Go on with the runs in the folder of `--out`."""

    seconds: tyro.conf.Fixed[float] = MOTION_S
    """Of motion; tests take less, figures never do."""

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
        """Those that fly; with `break_down` none, the streams tell."""
        return tuple(name for name in self.methods if name in FINALISTS and self.break_down is None)


def _refuse_unknown_rows(options: BenchmarkOptions) -> None:
    if (options.only, options.without) == (None, None):
        return
    from exograv.rig.twin.disturbances.levels import ROWS  # loads the twin

    for name, row in (("--only", options.only), ("--without", options.without)):
        if row is not None and row not in ROWS:
            raise ConfigError(f"{name} names no disturbance '{row}'; known: {', '.join(ROWS)}.")
