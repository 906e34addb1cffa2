"""Options of a session of assist-as-needed."""

import math
from dataclasses import dataclass
from typing import Annotated

from exograv.laboratory.support_level.options import SupportOptions, Synergy
from exograv.options import (
    Level,
    OneSideOption,
    OptionRecord,
    Options,
    PersonCode,
    RigArgument,
    Seed,
    Within,
    World,
    foreign_world,
)

SEED_OF_SESSION = 10_000
"""Distance between the seeds of two sessions of one person. Noise and mobilised strength differ from day to day."""


@dataclass(frozen=True)
class AssistOptions(Options):
    """Options of `exograv run assist`."""

    participant: Annotated[str, PersonCode("Give the code that stands for the person, such as P-07.")] = ""
    """Code of the person, such as P-07, never a name."""

    protocol: str = "assist-as-needed"
    """Protocol: `assist-as-needed`, or the path of your own protocol."""

    rig: RigArgument = "recupera_like_qdd"
    side: OneSideOption = None
    level: Level = 2
    world: World = "home"
    seed: Seed = 0

    strength: float | None = None
    """Strength of the virtual person in the first session, relative to a healthy adult; 0.1 by default."""

    synergy: Synergy = None

    gain: Annotated[float, Within(0.0, 2.0, "0 (stays as weak) to 2.")] = 0.15
    """Share by which the strength of the virtual person grows from session to session."""

    needed_percent: Annotated[float | None, Within(0.0, 100.0, "0 to 100, as `run support-level` found it.")] = None
    """Support that `exograv run support-level` has found. Without it the first session starts with full support."""

    new_session: bool = False
    """Start a new session. An interrupted session stays unfinished."""

    def __post_init__(self):
        super().__post_init__()
        self.person(1)

    def person(self, session: int) -> SupportOptions:
        """Options of machine and virtual person in this session.

        Raises:
            ConfigError: An option is outside its limits.
        """
        first = SupportOptions(self.rig, self.side, self.level, self.world, self.seed, self.strength, self.synergy)
        grown = first.strength_or_usual * math.pow(1.0 + self.gain, session - 1)
        return SupportOptions(self.rig, self.side, self.level, self.world, self.seed, min(grown, 1.0), self.synergy)

    def run_seed(self, session: int, blocks: int) -> int:
        """Seed of the noise in a session that continues after this number of blocks."""
        return self.seed + SEED_OF_SESSION * session + blocks

    @property
    def kept(self) -> OptionRecord:
        """Options of the virtual person and the machine, which must be the same in all sessions."""
        return foreign_world(self.world) | {
            "rig": self.rig, "side": self.side, "level": self.level, "seed": self.seed,
            "strength": self.strength, "synergy": self.synergy, "gain": self.gain,
        }  # fmt: skip
