"""Options of a search for the support that a person needs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Level, OneSideOption, Options, RigOption, Seed, Within

STRENGTH = 0.1
"""Of the person where none is named [-]: about half of the arm's weight has to be carried then."""

Synergy = Annotated[
    float | None,
    Within(0.0, 1.0, "0 (none) to 1."),
    tyro.conf.arg(help="Torque that bends the elbow over the one with which the shoulder lifts; none if not given."),
]


@dataclass(frozen=True)
class SupportOptions(Options):
    """Options of `exograv run support-level` with a virtual person."""

    rig: RigOption = "recupera_like_qdd"
    side: OneSideOption = None
    level: Level = 2
    seed: Seed = 0

    strength: float | None = None
    """Of the virtual person over a healthy adult's; 0.1 if neither this nor a file is given."""

    synergy: Synergy = None

    person_file: Path | None = None
    """TOML file of a virtual person: strength, synergy, mobilised_sd, noise (docs/howto/support_level.md)."""

    name: tyro.conf.Fixed[str] = "support_level"
    """Of recording and picture."""

    def __post_init__(self):
        if self.strength is not None and not 0.0 < self.strength <= 1.0:
            raise ConfigError(
                f"--strength is {self.strength:g}; allowed: above 0 to 1, a healthy adult. Somebody who "
                "needs half of the arm's weight carried has about 0.1."
            )
        super().__post_init__()
        if self.person_file is not None and (self.strength is not None or self.synergy is not None):
            raise ConfigError("--person-file says all of the person; give it without --strength and --synergy.")

    @property
    def strength_or_usual(self) -> float:
        """Of the person where no file says it [-]."""
        return STRENGTH if self.strength is None else self.strength
