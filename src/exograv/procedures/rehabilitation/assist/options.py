"""Options of a session of assist-as-needed."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.options import (
    ON_DRIVES,
    ON_SIMULATED,
    OneSideOption,
    OptionRecord,
    PersonCode,
    RigArgument,
    Within,
    WornOptions,
    foreign_world,
)
from exograv.procedures.rehabilitation.support_level.options import SupportOptions, Synergy, WeakPersonOptions

SEED_OF_SESSION = 10_000
"""Distance between the seeds of two sessions of one person. Noise and mobilised strength differ from day to day."""


@dataclass(frozen=True)
class AssistOptions(WornOptions):
    """Options of `exograv run assist`."""

    rig: RigArgument = "recupera_like_qdd"
    side: OneSideOption = None

    participant: Annotated[str, PersonCode("Give the code that stands for the person, such as P-07.")] = ""
    """Code of the person, such as P-07, never a name."""

    participants: Annotated[Path | None, ON_DRIVES] = None
    """Folder of the participants' files; by default `participants` in the folder of --out. A person with a file is only
    checked, in 20 s instead of 60; on drives only."""

    protocol: str = "assist-as-needed"
    """Protocol: `assist-as-needed`, or the path of your own protocol."""

    calibration: Annotated[Path | None, ON_DRIVES] = None
    """File calibration.toml of this machine, by default in the folder of --out; on drives only."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), ON_DRIVES] = 60.0
    """Duration of the motion with which an arm without a file is identified first, 10 or more; on drives only."""

    strength: Annotated[float | None, ON_SIMULATED] = None
    """Strength of the virtual person in the first session, relative to a healthy adult; 0.1 by default."""

    synergy: Annotated[Synergy, ON_SIMULATED] = None

    gain: Annotated[float, Within(0.0, 2.0, "0 (stays as weak) to 2."), ON_SIMULATED] = 0.15
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
        first = WeakPersonOptions(self.seed, self.strength, self.synergy)
        grown = first.strength_or_usual * math.pow(1.0 + self.gain, session - 1)
        return SupportOptions(
            rig=self.rig, side=self.side, level=self.level, world=self.world, seed=self.seed,
            drives=self.drives, simulate=self.simulate, calibration=self.calibration, real_time=self.real_time,
            strength=min(grown, 1.0), synergy=self.synergy,
        )  # fmt: skip

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
