"""What a session of assist-as-needed is asked for, refused before anything moves."""

import math
from dataclasses import dataclass
from typing import Any

from exograv.errors import ConfigError
from exograv.laboratory.support_level.options import SupportOptions
from exograv.model.description import Side
from exograv.storage.participant_schema import CODE, is_code

GAIN_MAX = 2.0
SEED_OF_SESSION = 10_000
"""Between the seeds of two sessions of one person: noise, and what each attempt mobilises, are the day's own."""


@dataclass(frozen=True)
class AssistOptions:
    """What `exograv assist` is asked for."""

    participant: str
    """A code, never a name."""

    protocol: str = "assist-as-needed"
    rig: str = "recupera_like_qdd"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    strength: float | None = None
    """Of the virtual person in the first session."""

    synergy: float | None = None
    gain: float = 0.15
    """By which share the virtual person is stronger from session to session; assumed."""

    needed_percent: float | None = None
    """What a test of support has found, to begin with."""

    new_session: bool = False
    """Whether a session that was broken off is left as it is, and another one begun."""

    def __post_init__(self):
        if not is_code(self.participant):
            raise ConfigError(
                f"--participant is '{self.participant}'; it must have {CODE}. Give the code that stands for the "
                "person, such as P-07."
            )
        if not 0.0 <= self.gain <= GAIN_MAX:
            raise ConfigError(f"--gain is {self.gain:g}; allowed: 0 (stays as weak) to {GAIN_MAX:g}.")
        if self.needed_percent is not None and not 0.0 <= self.needed_percent <= 100.0:
            raise ConfigError(
                f"--needed-percent is {self.needed_percent:g}; allowed: 0 to 100, as `exograv support-level` found it."
            )
        self.person(1)

    def person(self, session: int) -> SupportOptions:
        """Machine and virtual person of this session.

        Raises:
            ConfigError: An option is beyond what is allowed.
        """
        first = SupportOptions(self.rig, self.side, self.level, self.seed, self.strength, self.synergy)
        grown = first.strength_or_usual * math.pow(1.0 + self.gain, session - 1)
        return SupportOptions(self.rig, self.side, self.level, self.seed, min(grown, 1.0), self.synergy)

    def run_seed(self, session: int, blocks: int) -> int:
        """Of the noise of a session that goes on after so many blocks."""
        return self.seed + SEED_OF_SESSION * session + blocks

    @property
    def kept(self) -> dict[str, Any]:
        """What makes the virtual person and machine: the same from session to session."""
        return {
            "rig": self.rig, "side": self.side, "level": self.level, "seed": self.seed, "strength": self.strength,
            "synergy": self.synergy, "gain": self.gain,
        }  # fmt: skip
