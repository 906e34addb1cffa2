"""Options of a search for the support that a person needs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Acts, Level, OneSideOption, Options, RigArgument, Seed, Within, World

STRENGTH = 0.1
"""Default strength of the person [-]. With it, the machine must carry about half of the arm's weight."""

VIRTUAL = Acts(lambda all_: all_.recording is None, "for a virtual person, without --recording")

Synergy = Annotated[
    float | None,
    Within(0.0, 1.0, "0 (none) to 1."),
    tyro.conf.arg(help="Elbow flexion torque as a share of the shoulder's lifting torque; none by default."),
]


@dataclass(frozen=True)
class SupportOptions(Options):
    """Options of `exograv run support-level` with a virtual person."""

    rig: Annotated[RigArgument, VIRTUAL] = "recupera_like_qdd"
    side: Annotated[OneSideOption, VIRTUAL] = None
    level: Annotated[Level, VIRTUAL] = 2
    world: Annotated[World, VIRTUAL] = "home"
    seed: Annotated[Seed, VIRTUAL] = 0

    strength: float | None = None
    """Strength of the virtual person, relative to a healthy adult; 0.1 without this option and without a file."""

    synergy: Synergy = None

    person_file: Path | None = None
    """TOML file of a virtual person: strength, synergy, mobilised_sd, noise (docs/howto/support_level.md)."""

    name: tyro.conf.Fixed[str] = "support_level"
    """Name of recording and picture."""

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
