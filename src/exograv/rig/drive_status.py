"""What a drive says of itself, on any bus."""

import enum
from dataclasses import dataclass


class DriveFault(enum.IntFlag):
    """Why a drive does not do what it is told; several at once are possible."""

    NONE = 0
    WATCHDOG = 1
    """It was told nothing for too long, and brakes."""
    TEMPERATURE = 2
    CURRENT = 4
    ENCODER = 8
    STOP_LINE = 16
    """The hardware stop's line is open."""
    OTHER_MASTER = 32
    """Somebody else commands on this bus."""
    LOST = 64
    """It says nothing any more."""
    INTERNAL = 128


SENTENCES = {
    DriveFault.WATCHDOG: "was told nothing for too long and brakes by itself",
    DriveFault.TEMPERATURE: "is too hot",
    DriveFault.CURRENT: "has seen too much current",
    DriveFault.ENCODER: "does not trust its encoder",
    DriveFault.STOP_LINE: "sees an open stop line",
    DriveFault.OTHER_MASTER: "is commanded by somebody else too",
    DriveFault.LOST: "says nothing any more",
    DriveFault.INTERNAL: "has an internal fault",
}


@dataclass(frozen=True)
class DriveStatus:
    """Of one joint."""

    is_enabled: bool
    """Whether its motor gives the torque that it is told."""

    fault: DriveFault = DriveFault.NONE
    code: int = 0
    """The maker's own error code, 0 none."""

    temperature_C: float = float("nan")

    def sentence(self, joint: str) -> str:
        """What is wrong, for an operator."""
        found = [text for fault, text in SENTENCES.items() if fault in self.fault]
        code = f" (code 0x{self.code:04x})" if self.code else ""
        return f"The drive of {joint} {' and '.join(found) or 'is not enabled'}{code}."
