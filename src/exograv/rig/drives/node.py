"""State of one drive: what it said last, and the faults that are held against it until the operator enables again."""

import math
from abc import ABC, abstractmethod

from exograv.rig.drive_status import DriveFault, DriveStatus

from .settings import Drive


class Node(ABC):
    """Drive of one joint; its numbers are in its own units and directions, and stay as it said them last."""

    def __init__(self, drive: Drive, lost_after: int):
        """Begin without a fault; `lost_after` questions in a row without an answer, and it is silent."""
        self.drive, self._lost_after, self._misses = drive, lost_after, 0
        self.position = self.motor_position = math.nan
        """In counts or radians, as `Units` takes them."""
        self.current = 0.0
        """Measured [A]."""
        self.temperature_C = math.nan
        self.is_wanted = False
        """True if the drive shall give torque."""
        self.fault, self.code = DriveFault.NONE, 0
        self.own_fault = DriveFault.NONE
        """Fault that it is in without saying which."""

    @property
    @abstractmethod
    def is_on(self) -> bool:
        """True if the drive gives the torque that it is told."""

    @property
    def is_silent(self) -> bool:
        """True if it said nothing for so long that `read` does not wait for it any more."""
        return self._misses >= self._lost_after

    @property
    def was_lost(self) -> bool:
        """True if it was silent since the machine was enabled."""
        return DriveFault.LOST in self.fault

    @property
    def status(self) -> DriveStatus:
        """Its state for the operator."""
        is_on = self.is_on and not self.was_lost
        return DriveStatus(is_on, self.fault or self.own_fault, self.code, self.temperature_C)

    def hold_against(self, fault: DriveFault, code: int = 0) -> None:
        """Note a fault; it gives no torque until the machine is enabled."""
        self.fault |= fault
        self.code = code or self.code
        self.is_wanted = False


class AskedNode(Node):
    """Drive that is asked, answers and is told by itself, on a bus with others."""

    has_answered = False
    """True if all that is due to the last question is there."""

    @property
    @abstractmethod
    def stage(self) -> str:
        """Its state in words, for a drive that cannot be switched on."""

    @property
    def has_failed(self) -> bool:
        """True if it cannot be switched on now."""
        return False

    def start(self) -> None:
        """Begin to expect answers: it has been set up."""
        self._misses = 0
        self.fault &= ~DriveFault.LOST

    def ask(self) -> None:
        """Note that a question goes out."""
        self._misses += 1
        self.has_answered = False

    def lives(self) -> None:
        """Note that it has said something."""
        self._misses = 0

    def close(self) -> None:
        """Wait no longer for the answer to this question."""
        if self.is_silent:
            self.hold_against(DriveFault.LOST)

    def begin_enabling(self) -> None:
        """Forgive what was held against it; a fault that is not over comes back."""
        self.fault, self.code, self._misses = DriveFault.NONE, 0, 0

    @abstractmethod
    def enabling_order(self) -> bytes:
        """Next order on the way to giving torque, at none."""

    def end_enabling(self) -> None:
        """Let it give torque from now on."""
        self.is_wanted = True

    def switch_off(self) -> None:
        """Let it give no torque from now on."""
        self.is_wanted = False

    @abstractmethod
    def order(self, current: float, damping: float) -> bytes:
        """Order of a current [A] and a damping [N·m·s/rad]; it switches off a drive that is not to give torque."""
