"""Status and faults of a drive, the same for all buses."""

import enum
from dataclasses import dataclass


class DriveFault(enum.IntFlag):
    """Reasons why a drive does not follow its command; several at once are possible."""

    NONE = 0
    WATCHDOG = 1
    """The drive received no command for too long, and brakes."""
    TEMPERATURE = 2
    CURRENT = 4
    ENCODER = 8
    STOP_LINE = 16
    """The line of the hardware stop is open."""
    OTHER_MASTER = 32
    """Another master sends commands on this bus."""
    LOST = 64
    """The drive has stopped answering."""
    INTERNAL = 128


SENTENCES = {
    DriveFault.WATCHDOG: "received no command for too long and brakes by itself",
    DriveFault.TEMPERATURE: "is too hot",
    DriveFault.CURRENT: "reports overcurrent",
    DriveFault.ENCODER: "reports an encoder fault",
    DriveFault.STOP_LINE: "reports an open stop line",
    DriveFault.OTHER_MASTER: "receives commands from another master too",
    DriveFault.LOST: "has stopped answering",
    DriveFault.INTERNAL: "has an internal fault",
}


@dataclass(frozen=True)
class DriveStatus:
    """Status of the drive of one joint."""

    is_enabled: bool
    """True if the motor gives the commanded torque."""

    fault: DriveFault = DriveFault.NONE
    code: int = 0
    """Error code of the drive's maker; 0 for none."""

    temperature_C: float = float("nan")

    def sentence(self, joint: str) -> str:
        """Return a sentence for the operator that names the faults of the drive of `joint`."""
        found = [text for fault, text in SENTENCES.items() if fault in self.fault]
        code = f" (code 0x{self.code:04x})" if self.code else ""
        return f"The drive of {joint} {' and '.join(found) or 'is not enabled'}{code}."
