"""State of one moteus: its newest answer, and the orders that switch it on."""

import math

from moteus import Mode

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.node import AskedNode
from exograv.rig.drives.settings import Drive

from .frames import CommandLines, MoteusAnswer
from .modes import fault_of
from .nameplate import CommandScaling

LOST_AFTER = 3
"""Number of questions in a row without an answer after which a drive is lost: as many as the guard bridges

(docs/explanation/safety.md).
"""

RAD_PER_TURN = 2.0 * math.pi


class MoteusNode(AskedNode):
    """Drive of one joint."""

    def __init__(self, drive: Drive):
        super().__init__(drive, LOST_AFTER)
        self.said = MoteusAnswer(Mode.STOPPED, math.nan, 0.0, math.nan, math.nan, 0)
        self._is_waking = self._may_stop = False
        self._plate: CommandScaling | None = None
        self._orders: CommandLines | None = None

    def set_up(self, plate: CommandScaling, source: int, watchdog_s: float) -> None:
        """Take the drive's settings, which have been checked."""
        self._plate = plate
        most = plate.torque_per_ampere * self.drive.current_max_A
        self._orders = CommandLines(self.drive.node, source, most, watchdog_s)
        self.fault, self.code = DriveFault.NONE, 0

    @property
    def is_on(self) -> bool:
        """True if the drive gives the commanded torque."""
        return self.said.mode == Mode.POSITION

    @property
    def stage(self) -> str:
        """Name of the mode of the drive, for messages to the operator."""
        return f"in mode {self.said.mode}"

    @property
    def has_failed(self) -> bool:
        """True if the drive cannot be switched on now."""
        fault = self.fault & ~DriveFault.LOST | fault_of(self.said) & ~DriveFault.WATCHDOG
        return bool(fault) and not (self._may_stop and self.said.mode == Mode.FAULT)

    def answer(self, said: MoteusAnswer) -> None:
        """Take the answer to the question of this tick."""
        self.said, self.has_answered, self._misses = said, True, 0
        self.position, self.current = RAD_PER_TURN * said.turns, said.current_A
        self.temperature_C = said.temperature_C
        if self._is_waking:
            self.fault &= ~DriveFault.LOST
        else:
            self._judge()

    def begin_enabling(self) -> None:
        """Clear the noted faults. A fault whose cause lasts is reported again."""
        super().begin_enabling()
        self._is_waking = self._may_stop = True

    def enabling_order(self) -> bytes:
        """Next order in the sequence that switches the drive on, at zero torque."""
        orders, mode = self._orders, self.said.mode
        if orders is None:
            return b""
        if mode == Mode.TIMEOUT or (mode == Mode.FAULT and self._may_stop):
            return orders.stop
        self._may_stop = False  # a fault that comes back still has its cause
        return orders.torque(0.0, 0.0)

    def end_enabling(self) -> None:
        """Allow torque from now on, or note the drive's fault again."""
        super().end_enabling()
        self._is_waking = False
        self._judge()

    def order(self, current: float, damping: float) -> bytes:
        """Order of a current [A] and a damping [N·m·s/rad]; a drive that shall give no torque shorts its windings."""
        orders, plate = self._orders, self._plate
        if orders is None or plate is None:
            return b""
        if not self.is_wanted:
            return orders.brake
        return orders.torque(plate.torque_per_ampere * current, damping / plate.kd)

    def _judge(self) -> None:
        said = self.said
        if fault := fault_of(said):
            self.hold_against(fault, said.code if said.mode == Mode.FAULT else 0)
        if said.mode != Mode.POSITION:
            self.is_wanted = False  # it has restarted, or was stopped: only `enable` switches it on
