"""Options of a verification."""

from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.model.description import Side

LATER_MAX_MIN = 240.0


@dataclass(frozen=True)
class VerifyOptions:
    """What `exograv verify` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    calibration: Path | None = None
    before: Path | None = None
    """Figures of a former verification, to say what changed."""
    later_min: float = 0.0
    """That the machine runs between identification and verification [min]."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 0.0 <= self.later_min <= LATER_MAX_MIN:
            raise ConfigError(f"--later is {self.later_min:g} min; allowed: 0 to {LATER_MAX_MIN:g} min.")
