"""What a demonstration on the twin is asked for, refused before anything moves."""

from dataclasses import dataclass, field
from pathlib import Path

from exograv.errors import ConfigError
from exograv.model.description import Side
from exograv.procedures.identification.method_names import MethodName, MotionName, TorqueSourceName
from exograv.procedures.identification.participant_session import ParticipantOptions
from exograv.rig.twin import day_seed

DONNINGS_MAX = 1000
GRAVITY_LEVEL_MAX = 1.0  # above 1 the arm would be pushed down: that needs a mode of its own (docs/safety.md)


@dataclass(frozen=True)
class DemoOptions:
    """What the demonstration is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    method: MethodName = "recursive"
    gravity_level: float = 0.0
    seed: int = 0
    seconds: float = 60.0
    torque_source: TorqueSourceName = "current"
    realtime: bool = False
    only_identify: bool = False
    wearer_model: str | None = None
    """MJCF or URDF of an arm that is the truth (docs/wearer_models.md)."""
    wearer_map: str | None = None
    calibration: Path | None = None
    """Of this machine, stored; measured at the start where absent."""
    donning: int = 0
    """Day on which the twin's wearer is in the machine, 0 the first."""
    files: ParticipantOptions = field(default_factory=ParticipantOptions)
    motion: MotionName = "designed"
    """What moves the arm while it is identified."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if not 0.0 <= self.gravity_level <= GRAVITY_LEVEL_MAX:
            raise ConfigError(
                f"--gravity-level is {self.gravity_level}; allowed: 0 (weightless) to {GRAVITY_LEVEL_MAX:g} (Earth). "
                "The Moon is 0.165, Mars 0.378."
            )
        if not 5.0 <= self.seconds <= 600.0:
            raise ConfigError(f"--seconds is {self.seconds}; allowed: 5 to 600 s of motion.")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 0 <= self.donning <= DONNINGS_MAX:
            raise ConfigError(f"--donning is {self.donning}; allowed: 0 (the first) to {DONNINGS_MAX}.")

    @property
    def day(self) -> int:
        """Seed of what is drawn anew at each donning: noise and muscles."""
        return day_seed(self.seed, self.donning)
