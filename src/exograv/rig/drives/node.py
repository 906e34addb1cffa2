"""State of one drive: its newest report, and the faults that stay noted until the operator enables again."""

import math
from abc import ABC, abstractmethod

from exograv.rig.drive_status import DriveFault, DriveStatus

from .settings import Drive


class Node(ABC):
    """Drive of one joint. Its numbers are in the drive's own units and directions, and keep their last values."""

    def __init__(self, drive: Drive, lost_after: int):
        """Start without a fault. The drive counts as silent after `lost_after` questions in a row without an answer."""
        self.drive, self._lost_after, self._misses = drive, lost_after, 0
        self.position = self.motor_position = math.nan
        """Positions in counts or radians, in the form that `Units` expects."""
        self.current = 0.0
        """Measured current [A]."""
        self.temperature_C = math.nan
        self.is_wanted = False
        """True if the drive shall give torque."""
        self.fault, self.code = DriveFault.NONE, 0
        self.own_fault = DriveFault.NONE
        """Present fault state of a drive that does not report which fault it has."""

    @property
    @abstractmethod
    def is_on(self) -> bool:
        """True if the drive gives the commanded torque."""

    @property
    def is_silent(self) -> bool:
        """True if the drive has been silent for so long that `read` no longer waits for it."""
        return self._misses >= self._lost_after

    @property
    def was_lost(self) -> bool:
        """True if the drive has been silent at any time since the machine was enabled."""
        return DriveFault.LOST in self.fault

    @property
    def status(self) -> DriveStatus:
        """Status of the drive for the operator."""
        is_on = self.is_on and not self.was_lost
        return DriveStatus(is_on, self.fault or self.own_fault, self.code, self.temperature_C)

    def hold_against(self, fault: DriveFault, code: int = 0) -> None:
        """Note a fault. The drive gives no torque until the machine is enabled again."""
        self.fault |= fault
        self.code = code or self.code
        self.is_wanted = False


class AskedNode(Node):
    """Drive on a shared bus that is asked, answers and is commanded separately."""

    has_answered = False
    """True if all answers to the last question have arrived."""

    @property
    def is_awaited(self) -> bool:
        """True if the answer to the present question is missing, of a drive that was not silent before it."""
        return not self.has_answered and self._misses <= self._lost_after

    @property
    @abstractmethod
    def stage(self) -> str:
        """Name of the drive's state, for the message about a drive that cannot be switched on."""

    @property
    def has_failed(self) -> bool:
        """True if the drive cannot be switched on now."""
        return False

    def start(self) -> None:
        """Start to expect answers, after the drive has been set up."""
        self._misses = 0
        self.fault &= ~DriveFault.LOST

    def ask(self) -> None:
        """Note that a question is sent."""
        self._misses += 1
        self.has_answered = False

    def lives(self) -> None:
        """Note that the drive has sent a frame."""
        self._misses = 0

    def close(self) -> None:
        """Stop waiting for the answer to this question."""
        if self.is_silent:
            self.hold_against(DriveFault.LOST)

    def begin_enabling(self) -> None:
        """Clear the noted faults. A fault whose cause lasts is reported again."""
        self.fault, self.code, self._misses = DriveFault.NONE, 0, 0

    @abstractmethod
    def enabling_order(self) -> bytes:
        """Next order in the sequence that switches the drive on, at zero torque."""

    def end_enabling(self) -> None:
        """Allow torque from now on."""
        self.is_wanted = True

    def switch_off(self) -> None:
        """Allow no torque from now on."""
        self.is_wanted = False

    @abstractmethod
    def order(self, current: float, damping: float) -> bytes:
        """Order of a current [A] and a damping [N·m·s/rad]. It switches off a drive that shall give no torque."""
