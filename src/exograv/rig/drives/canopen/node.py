"""State of one CiA 402 drive: its frames, its state machine, and answers without a sequence number."""

import math
from collections.abc import Callable, Mapping

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.node import AskedNode
from exograv.rig.drives.settings import Drive

from . import objects as at
from .emergency import FRAME, fault_of
from .objects import CobId, Nmt
from .states import DISABLE_VOLTAGE, ENABLE, QUICK_STOP, Cia402State, next_control, state_of

LOST_AFTER_S = 0.003
"""Time without an answer to any SYNC after which a drive is lost [s].

It is as long as the guard bridges (docs/explanation/safety.md). The guard thus learns of the one lost joint before it
has to treat the whole machine as silent.
"""


def lost_after(period_s: float) -> int:
    """Return the number of SYNCs without an answer after which a drive is lost."""
    return math.ceil(round(LOST_AFTER_S / period_s, 6))


MEASURED, MOTOR, SLOW = at.layout(at.MEASURED), at.layout(at.MOTOR), at.layout(at.SLOW)
TOLD, TOLD_DAMPED = at.layout(at.COMMAND), at.layout((*at.COMMAND, at.DAMPING))

DAMPING_MOST = 65.535
"""Greatest damping that the frame can carry [N·m·s/rad]."""

PER_MILLE_MOST = 2**15 - 1
"""Greatest current that the frame can carry, in per mille of the rated current [-]."""

IN_FAULT = (Cia402State.FAULT, Cia402State.FAULT_REACTION)


class OwedAnswers:
    """Answers of one kind that a drive owes.

    Answers carry no number, so an answer to an older SYNC looks like a present one. Where an answer is missing, the
    next one counts for it, until a whole period has passed without a late answer.
    """

    def __init__(self):
        self.missing = 0
        self._came_late = False

    def ask(self) -> None:
        """Note that a SYNC is sent."""
        self.missing = self.missing + 1 if self._came_late else 1

    def came(self) -> None:
        """Note that an answer has arrived."""
        self.missing, self._came_late = max(self.missing - 1, 0), True

    def close(self) -> None:
        """Note that further answers to this SYNC are late."""
        self._came_late = False


class CanopenNode(AskedNode):
    """Drive of one joint; handlers take a frame's data, and a frame that is too short is ignored."""

    def __init__(self, drive: Drive, has_motor: bool, period_s: float):
        super().__init__(drive, lost_after(period_s))
        self._has_motor, self._measured, self._motor = has_motor, OwedAnswers(), OwedAnswers()
        self.position = self.motor_position = 0
        self.state = Cia402State.NOT_READY
        self.control = DISABLE_VOLTAGE
        """Control word of the commands to the drive."""
        self.has_damping = False
        """True if the commands carry a damping."""
        self._amperes = drive.current_rated_A / 1000.0
        """One step of a current [A]: the drive takes currents in per mille of its rated current."""
        self.handlers: Mapping[int, Callable[[bytes], None]] = {
            CobId.EMERGENCY: self.on_emergency,
            CobId.MEASURED: self.on_measured,
            CobId.MOTOR: self.on_motor,
            CobId.SLOW: self.on_slow,
            CobId.HEARTBEAT: self.on_heartbeat,
        }
        """Handlers by the number of the frame without the drive's own number."""

    @property
    def is_on(self) -> bool:
        """True if the drive gives the commanded torque."""
        return self.state is Cia402State.OPERATION_ENABLED and self.control == ENABLE

    @property
    def stage(self) -> str:
        """Name of the state of the drive, for messages to the operator."""
        return self.state.value

    def ask(self) -> None:
        """Note that a SYNC is sent."""
        super().ask()
        self._measured.ask()
        if self._has_motor:
            self._motor.ask()

    def close(self) -> None:
        """Stop waiting for the answer to this SYNC."""
        self._measured.close()
        self._motor.close()
        super().close()

    def hold_against(self, fault: DriveFault, code: int = 0) -> None:
        """Note a fault. The commands switch the drive off until the machine is enabled."""
        super().hold_against(fault, code)
        self.control = DISABLE_VOLTAGE

    def enabling_order(self) -> bytes:
        """Next step of the state machine towards torque mode, at zero torque."""
        self.control = next_control(self.state, self.control)
        return self.order(0.0, 0.0)

    def switch_off(self) -> None:
        """Allow no torque from now on."""
        super().switch_off()
        self.control = DISABLE_VOLTAGE

    def order(self, current: float, damping: float) -> bytes:
        """Command of a current [A] and a damping [N·m·s/rad], each rounded to the nearest step.

        A drive without a damping object brakes by its own quick stop instead, and is off after it.
        """
        is_told = self.is_wanted and not self.fault
        per_mille = min(max(round(current / self._amperes), -PER_MILLE_MOST), PER_MILLE_MOST) if is_told else 0
        braking = round(1000.0 * min(max(damping, 0.0), DAMPING_MOST))
        if self.has_damping:
            return TOLD_DAMPED.pack(self.control, per_mille, braking)
        if braking and is_told:
            self.control = QUICK_STOP
        return TOLD.pack(self.control, per_mille)

    def on_measured(self, data: bytes) -> None:
        """Store the status, position and torque of a received frame."""
        if len(data) < MEASURED.size:
            return
        self._misses = 0
        self._came(self._measured)
        word, self.position, per_mille = MEASURED.unpack_from(data)
        self.state, self.current = state_of(word), self._amperes * per_mille
        self.own_fault = DriveFault.INTERNAL if self.state in IN_FAULT else DriveFault.NONE
        if self.is_wanted and self.state is not Cia402State.OPERATION_ENABLED:
            self.switch_off()

    def on_motor(self, data: bytes) -> None:
        """Take the position of the motor's shaft."""
        if len(data) >= MOTOR.size:
            self._came(self._motor)
            (self.motor_position,) = MOTOR.unpack_from(data)

    def _came(self, due: OwedAnswers) -> None:
        due.came()
        self.has_answered = not (self._measured.missing or self._motor.missing)

    def on_slow(self, data: bytes) -> None:
        """Store the winding temperature of a received frame."""
        if len(data) >= SLOW.size:
            self.temperature_C = 0.1 * SLOW.unpack_from(data)[0]

    def on_emergency(self, data: bytes) -> None:
        """Take an emergency frame. A frame that reports the end of a fault does not clear the noted fault."""
        if len(data) >= FRAME.size and (code := FRAME.unpack_from(data)[0]):
            self.hold_against(fault_of(code), code)

    def on_heartbeat(self, data: bytes) -> None:
        """Take a heartbeat. A drive that has just started has lost its settings and counts as lost."""
        if data and data[0] == Nmt.BOOTED:
            self._misses = self._lost_after + 1  # its answer is not awaited
            self.hold_against(DriveFault.LOST)
