"""What one moteus said last, and what is held against it until somebody enables the machine again."""

import math

from moteus import Mode

from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.settings import Drive

from .frames import MoteusAnswer, Orders
from .modes import fault_of
from .nameplate import Plate

LOST_AFTER = 3
"""Questions in a row without an answer: as many as the guard bridges (docs/safety.md)."""


class MoteusNode:
    """Of one joint."""

    def __init__(self, drive: Drive):
        self.drive = drive
        self.said = MoteusAnswer(Mode.STOPPED, math.nan, 0.0, math.nan, math.nan, 0)
        self.is_wanted = False
        """Whether it shall give torque."""
        self.fault, self.code = DriveFault.NONE, 0
        self.has_answered, self._misses = False, 0
        self._is_waking = self._may_stop = False
        self._plate: Plate | None = None
        self._orders: Orders | None = None

    def set_up(self, plate: Plate, source: int, watchdog_s: float) -> None:
        """Its settings are known, and right."""
        self._plate = plate
        most = plate.torque_per_ampere * self.drive.current_max_A
        self._orders = Orders(self.drive.node, source, most, watchdog_s)
        self.fault, self.code, self._misses = DriveFault.NONE, 0, 0

    @property
    def is_silent(self) -> bool:
        """Whether it said nothing for so long that nobody waits for it any more."""
        return self._misses >= LOST_AFTER

    @property
    def was_lost(self) -> bool:
        """Whether it was silent since somebody enabled the machine."""
        return DriveFault.LOST in self.fault

    @property
    def is_on(self) -> bool:
        """Whether it gives what it is told."""
        return self.said.mode == Mode.POSITION

    @property
    def status(self) -> DriveStatus:
        """For the operator."""
        return DriveStatus(self.is_on and not self.was_lost, self.fault, self.code, self.said.temperature_C)

    def ask(self) -> None:
        """A question goes out."""
        self.has_answered = False
        self._misses += 1

    def answer(self, said: MoteusAnswer) -> None:
        """To the question of this tick."""
        self.said, self.has_answered, self._misses = said, True, 0
        if self._is_waking:
            self.fault &= ~DriveFault.LOST
        else:
            self._judge()

    def lives(self) -> None:
        """It has answered, too late to be believed."""
        self._misses = 0

    def close(self) -> None:
        """Nobody waits for this question's answer any more."""
        if self.is_silent:
            self.hold_against(DriveFault.LOST)

    def hold_against(self, fault: DriveFault, code: int = 0) -> None:
        """A fault, until somebody enables the machine."""
        self.fault |= fault
        self.code = code or self.code
        self.is_wanted = False

    def torque(self, current_A: float, damping: float) -> bytes:
        """The order that gives so much, or brakes where it is not to give any [A], [N·m·s/rad]."""
        orders, plate = self._orders, self._plate
        if orders is None or plate is None:
            return b""
        if not self.is_wanted:
            return orders.brake
        return orders.torque(plate.torque_per_ampere * current_A, damping / plate.kd)

    @property
    def brake(self) -> bytes:
        """The order that shorts its windings."""
        return b"" if self._orders is None else self._orders.brake

    @property
    def has_failed(self) -> bool:
        """Whether it cannot be switched on now."""
        fault = self.fault & ~DriveFault.LOST | fault_of(self.said) & ~DriveFault.WATCHDOG
        return bool(fault) and not (self._may_stop and self.said.mode == Mode.FAULT)

    def begin_waking(self) -> None:
        """Somebody enables the machine: what was held against it is forgiven, if it is over."""
        self.fault, self.code, self._misses = DriveFault.NONE, 0, 0
        self._is_waking = self._may_stop = True

    def wake(self) -> bytes:
        """The next order on the way to giving torque, at none."""
        orders, mode = self._orders, self.said.mode
        if orders is None:
            return b""
        if mode == Mode.TIMEOUT or (mode == Mode.FAULT and self._may_stop):
            return orders.stop
        self._may_stop = False  # a fault that comes back is not over
        return orders.torque(0.0, 0.0)

    def end_waking(self) -> None:
        """It gives torque from now on, or its fault is held against it again."""
        self._is_waking, self.is_wanted = False, True
        self._judge()

    def _judge(self) -> None:
        said = self.said
        if fault := fault_of(said):
            self.hold_against(fault, said.code if said.mode == Mode.FAULT else 0)
        if said.mode != Mode.POSITION:
            self.is_wanted = False  # it has started anew, or somebody has stopped it: never on again by itself
