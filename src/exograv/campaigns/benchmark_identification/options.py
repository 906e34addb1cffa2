"""What the benchmark is asked for, checked before its first minute."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

from exograv.errors import ConfigError
from exograv.procedures.identification.method_names import MethodName
from exograv.rig.twin.disturbances.levels import ROWS

from .cases import Case, ProfileName, by_machine, population
from .streams import MOTION_S
from .work import WearerTask

FINALISTS = ("recursive", "gradient", "gradient-full")
"""Flown in closed loop too: ours, and the paper's method with its own model and with ours."""

BreakDown = Literal["without", "only"]


@dataclass(frozen=True)
class BenchmarkOptions:
    """What the benchmark is asked for."""

    wearers: int = 3
    """In closed loop."""

    streams: int = 3
    """In open loop."""

    levels: tuple[int, ...] = (2,)
    profiles: tuple[ProfileName, ...] = ("harmonic",)
    methods: tuple[MethodName, ...] = get_args(MethodName)
    seed_from: int = 0
    only: str | None = None
    without: str | None = None
    never_relaxed: bool = False
    break_down: BreakDown | None = None
    """Every disturbance in turn: all others at the level ("without"), or all others at level 0 ("only")."""

    processes: int = 1
    resume: bool = False
    seconds: float = MOTION_S
    """Of motion; tests take less, figures never do."""

    def __post_init__(self):
        _refuse_numbers(self)
        if sum(one is not None for one in (self.only, self.without, self.break_down)) > 1:
            raise ConfigError("--only, --without and --break-down exclude each other; give one of them.")
        for name, row in (("--only", self.only), ("--without", self.without)):
            if row is not None and row not in ROWS:
                raise ConfigError(f"{name} names no disturbance '{row}'; known: {', '.join(ROWS)}.")
        if self.break_down is not None and self.streams == 0:
            raise ConfigError("--break-down compares open-loop streams; --streams is 0. Give it 1 or more.")
        if self.break_down is not None and (self.never_relaxed or len(self.levels) > 1):
            raise ConfigError("--break-down takes one level and no --never-relaxed. Run it once for each.")

    @property
    def closed_loop_methods(self) -> tuple[MethodName, ...]:
        """Those that fly; with `break_down` none, the streams tell."""
        return tuple(name for name in self.methods if name in FINALISTS and self.break_down is None)


def methods_of(text: str) -> tuple[MethodName, ...]:
    """Methods by their names with commas between them.

    Raises:
        ConfigError: One is unknown, or named twice.
    """
    return cast(tuple[MethodName, ...], _known(text, "--methods", get_args(MethodName)))


def profiles_of(text: str) -> tuple[ProfileName, ...]:
    """Kinds of drive in the same way.

    Raises:
        ConfigError: One is unknown, or named twice.
    """
    return cast(tuple[ProfileName, ...], _known(text, "--profiles", get_args(ProfileName)))


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


def _refuse_numbers(options: BenchmarkOptions) -> None:
    for name, value in (("--wearers", options.wearers), ("--streams", options.streams)):
        if not 0 <= value <= 1000:
            raise ConfigError(f"{name} is {value}; allowed: 0 to 1000.")
    if options.wearers + options.streams == 0:
        raise ConfigError("--wearers and --streams are both 0; nothing would run. Give one of them 1 or more.")
    if options.seed_from < 0:
        raise ConfigError(
            f"--seed-from is {options.seed_from}; allowed: 0 and above. Tune from 1000 on, report from 0."
        )
    if not 1 <= options.processes <= 64:
        raise ConfigError(f"--processes is {options.processes}; allowed: 1 to 64.")


def machines(options: BenchmarkOptions) -> list[list[WearerTask]]:
    """Everything to be run, the wearers of one machine together."""
    cases = [
        case for level in options.levels for profile in options.profiles for case in _cases(options, level, profile)
    ]
    return [[_task(options, case) for case in group] for group in by_machine(cases)]


def _cases(options: BenchmarkOptions, level: int, profile: ProfileName) -> list[Case]:
    kind = options.break_down
    count = options.streams if kind else max(options.wearers, options.streams)
    more = options.only, options.without, options.never_relaxed
    whole = population(profile, level, count, options.seed_from, *more)
    if kind is None:
        return whole
    # One alone is told from none, one off from all.
    reference = whole if kind == "without" else population(profile, 0, count, options.seed_from)
    return [*reference, *(replace(case, **{kind: row}) for row in ROWS for case in whole)]


def _task(options: BenchmarkOptions, case: Case) -> WearerTask:
    k = case.wearer_seed - options.seed_from
    return WearerTask(
        case,
        options.methods if k < options.streams else (),
        options.closed_loop_methods if k < options.wearers else (),
    )
