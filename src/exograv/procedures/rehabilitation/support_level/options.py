"""Options of a search for the support that a person needs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.errors import ConfigError
from exograv.options import (
    ON_DRIVES,
    Acts,
    Level,
    OneSideOption,
    Options,
    RigArgument,
    Seed,
    Within,
    World,
    WornOptions,
)

STRENGTH = 0.1
"""Default strength of the person [-]. With it, the machine must carry about half of the arm's weight."""


def _is_virtual(all_: Any) -> bool:
    return getattr(all_, "recording", None) is None and (all_.drives is None or all_.simulate)


UNRECORDED = Acts(lambda all_: all_.recording is None, "without --recording")
VIRTUAL = Acts(_is_virtual, "for a virtual person, without --recording and without real drives")

Synergy = Annotated[
    float | None,
    Within(0.0, 1.0, "0 (none) to 1."),
    tyro.conf.arg(help="Elbow flexion torque as a share of the shoulder's lifting torque; none by default."),
]

REAL_TIME = (
    "--real-time is given, but the virtual person of this command plans its motions in the process of the drives, "
    "which would then be late. Leave it out."
)


@dataclass(frozen=True)
class WeakPersonOptions(Options):
    """Virtual person of little strength."""

    seed: Seed = 0

    strength: float | None = None
    """Strength of the virtual person, relative to a healthy adult; 0.1 without this option and without a file."""

    synergy: Synergy = None

    person_file: Path | None = None
    """TOML file of a virtual person: strength, synergy, mobilised_sd, noise (docs/howto/support_level.md)."""

    def __post_init__(self):
        if self.strength is not None and not 0.0 < self.strength <= 1.0:
            raise ConfigError(
                f"--strength is {self.strength:g}; allowed: above 0 to 1, a healthy adult. A person who "
                "needs support of half of the arm's weight has about 0.1."
            )
        super().__post_init__()
        if self.person_file is not None and (self.strength is not None or self.synergy is not None):
            raise ConfigError("--person-file describes the whole person; give it without --strength and --synergy.")

    @property
    def strength_or_usual(self) -> float:
        """Strength of the person without a file [-]."""
        return STRENGTH if self.strength is None else self.strength

    @property
    def simulation(self) -> tuple[str, ...]:
        """Options of `exograv dev drive-sim` for this person behind simulated drives."""
        given = {"--strength": self.strength, "--synergy": self.synergy, "--person-file": self.person_file}
        words = [word for flag, value in given.items() if value is not None for word in (flag, str(value))]
        return ("--worn", "--person", "weak", *words)


@dataclass(frozen=True)
class SupportOptions(WeakPersonOptions, WornOptions):
    """Options of `exograv run support-level`."""

    rig: Annotated[RigArgument, UNRECORDED] = "recupera_like_qdd"
    side: Annotated[OneSideOption, UNRECORDED] = None
    level: Annotated[Level, VIRTUAL] = 2
    world: Annotated[World, VIRTUAL] = "home"
    seed: Annotated[Seed, VIRTUAL] = 0

    calibration: Annotated[Path | None, ON_DRIVES] = None
    """File calibration.toml of this machine, by default in the folder of --out; on drives only."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), ON_DRIVES] = 60.0
    """Duration of the motion with which an arm without a file is identified first, 10 or more; on drives only."""

    name: tyro.conf.Fixed[str] = "support_level"
    """Name of recording and picture."""

    def __post_init__(self):
        super().__post_init__()
        if self.real_time:
            raise ConfigError(REAL_TIME)
