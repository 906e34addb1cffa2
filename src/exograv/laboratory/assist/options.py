"""Options of a session of assist-as-needed."""

import math
from dataclasses import dataclass
from typing import Annotated

from exograv.laboratory.support_level.options import SupportOptions, Synergy
from exograv.options import Level, OneSideOption, OptionRecord, Options, PersonCode, RigOption, Seed, Within

SEED_OF_SESSION = 10_000
"""Between the seeds of two sessions of one person: noise, and what each attempt mobilises, are the day's own."""


@dataclass(frozen=True)
class AssistOptions(Options):
    """Options of `exograv run assist`."""

    participant: Annotated[str, PersonCode("Give the code that stands for the person, such as P-07.")] = ""
    """Code that stands for the person, such as P-07, never a name."""

    protocol: str = "assist-as-needed"
    """`assist-as-needed`, or the path of a protocol of your own."""

    rig: RigOption = "recupera_like_qdd"
    side: OneSideOption = None
    level: Level = 2
    seed: Seed = 0

    strength: float | None = None
    """Of the virtual person in the first session, over a healthy adult's; 0.1 if not given."""

    synergy: Synergy = None

    gain: Annotated[float, Within(0.0, 2.0, "0 (stays as weak) to 2.")] = 0.15
    """By which share the virtual person is stronger from session to session."""

    needed_percent: Annotated[float | None, Within(0.0, 100.0, "0 to 100, as `run support-level` found it.")] = None
    """Support that a test has found (`exograv run support-level`); without it the first session begins at full
    support."""

    new_session: bool = False
    """Leave a session that was broken off as it is, and begin another one."""

    def __post_init__(self):
        super().__post_init__()
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
    def kept(self) -> OptionRecord:
        """What makes the virtual person and machine: the same from session to session."""
        return {
            "rig": self.rig, "side": self.side, "level": self.level, "seed": self.seed, "strength": self.strength,
            "synergy": self.synergy, "gain": self.gain,
        }  # fmt: skip
