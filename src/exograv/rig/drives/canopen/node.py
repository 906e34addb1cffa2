"""What one drive has said last, and what is held against it until somebody enables the machine again."""

import math

from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.settings import Drive

from . import objects as at
from .emergency import FRAME, fault_of
from .objects import Nmt
from .states import DISABLE_VOLTAGE, Cia402State, state_of

LOST_AFTER_S = 0.003
"""Of SYNCs in a row without any answer, after which a drive is lost: as many as the guard bridges (docs/safety.md), so
that it hears of the one joint before it has to take the whole machine for silent [s]."""


def lost_after(period_s: float) -> int:
    """So many SYNCs."""
    return math.ceil(round(LOST_AFTER_S / period_s, 6))


MEASURED, MOTOR, SLOW = at.layout(at.MEASURED), at.layout(at.MOTOR), at.layout(at.SLOW)


class Due:
    """Answers of one kind that a drive owes.

    They carry no number, so that one of an older SYNC looks like one of now: where one is missing, the next counts for
    it, until a whole period has passed in which none came late.
    """

    def __init__(self):
        self.missing = 0
        self._came_late = False

    def ask(self) -> None:
        """A SYNC goes out."""
        self.missing = self.missing + 1 if self._came_late else 1

    def came(self) -> None:
        """One answer."""
        self.missing, self._came_late = max(self.missing - 1, 0), True

    def close(self) -> None:
        """From now on they are late."""
        self._came_late = False


class CanopenNode:
    """Of one joint; handlers take a frame's data, and a frame that is too short is none."""

    def __init__(self, drive: Drive, has_motor: bool, period_s: float):
        self.drive, self._has_motor = drive, has_motor
        self._misses_most = lost_after(period_s)
        self.state = Cia402State.NOT_READY
        self.counts = self.motor_counts = self.per_mille = 0
        self.control = DISABLE_VOLTAGE
        """What its commands carry."""
        self.is_wanted = False
        """Whether it shall give torque."""
        self.fault, self.code = DriveFault.NONE, 0
        self.temperature_C = float("nan")
        self.is_configured = False
        self.has_damping = False
        """Whether its commands carry a damping."""
        self.rated_torque_Nm = 0.0
        """As it says itself."""
        self._measured, self._motor, self._misses = Due(), Due(), 0

    @property
    def is_lost(self) -> bool:
        """Whether it said nothing for so long that nobody waits for it any more."""
        return DriveFault.LOST in self.fault

    @property
    def is_faulty(self) -> bool:
        """Whether it does not do what it is told."""
        if self.fault or self.state in (Cia402State.FAULT, Cia402State.FAULT_REACTION):
            return True
        return self.is_wanted and self.state is not Cia402State.OPERATION_ENABLED

    @property
    def has_answered(self) -> bool:
        """Whether all that is due to the last SYNC is there."""
        return self._measured.missing == 0 and self._motor.missing == 0

    def ask(self) -> None:
        """A SYNC goes out."""
        self._measured.ask()
        if self._has_motor:
            self._motor.ask()
        self._misses += 1

    def close(self) -> None:
        """Nobody waits for this SYNC's answer any more."""
        self._measured.close()
        self._motor.close()
        if self._misses >= self._misses_most and self.is_configured:
            self.hold_against(DriveFault.LOST)

    def hold_against(self, fault: DriveFault, code: int = 0) -> None:
        """A fault, until `forgive`: its commands switch it off."""
        self.fault |= fault
        self.code = code or self.code
        self.control = DISABLE_VOLTAGE

    def forgive(self) -> None:
        """Somebody enables the machine."""
        self.fault, self.code, self._misses = DriveFault.NONE, 0, 0

    def start(self) -> None:
        """It has been set up, and will answer from now on."""
        self.is_configured, self._misses = True, 0
        self.fault &= ~DriveFault.LOST

    def on_measured(self, data: bytes) -> None:
        """Status, position and torque."""
        if len(data) < MEASURED.size:
            return
        self._misses = 0
        self._measured.came()
        word, self.counts, self.per_mille = MEASURED.unpack_from(data)
        self.state = state_of(word)
        if self.is_wanted and self.state is not Cia402State.OPERATION_ENABLED:
            self.control = DISABLE_VOLTAGE

    def on_motor(self, data: bytes) -> None:
        """Position of the motor's shaft."""
        if len(data) >= MOTOR.size:
            self._motor.came()
            (self.motor_counts,) = MOTOR.unpack_from(data)

    def on_slow(self, data: bytes) -> None:
        """Temperature of the winding."""
        if len(data) >= SLOW.size:
            self.temperature_C = 0.1 * SLOW.unpack_from(data)[0]

    def on_emergency(self, data: bytes) -> None:
        """Something is wrong, or over; what is over is not forgiven by it."""
        if len(data) >= FRAME.size and (code := FRAME.unpack_from(data)[0]):
            self.hold_against(fault_of(code), code)

    def on_heartbeat(self, data: bytes) -> None:
        """A drive that has just started knows nothing of what it was set to."""
        if data and data[0] == Nmt.BOOTED and self.is_configured:
            self.is_configured = False
            self.hold_against(DriveFault.LOST)

    @property
    def status(self) -> DriveStatus:
        """For an operator."""
        fault = self.fault
        if not fault and self.state in (Cia402State.FAULT, Cia402State.FAULT_REACTION):
            fault = DriveFault.INTERNAL  # it has not said which
        is_enabled = self.state is Cia402State.OPERATION_ENABLED and not self.is_lost
        return DriveStatus(is_enabled, fault, self.code, self.temperature_C)
