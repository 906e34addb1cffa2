"""Simulated drive as a node of a CAN bus: object dictionary, mapped frames, emergencies."""

import math
import struct
from collections.abc import Callable
from typing import Any

from canopen import LocalNode, Network, SdoAbortedError
from canopen import objectdictionary as kinds

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.simulated.plant import Plant

from .dictionary import INVALID, MAPPED_MOST, RECEIVED, SENT, object_dictionary
from .state_machine import StateMachine, StatusState

OPERATIONAL, PRE_OPERATIONAL = "OPERATIONAL", "PRE-OPERATIONAL"
CYCLIC_TORQUE = 10
ADDITIONAL_POSITION = 0x60E4
"""Position of the encoder on the motor's shaft; a drive without one lacks the object."""
AT_ONCE = 0xFE
"""First transmission type that does not wait for a SYNC."""

NOT_NOW, NOT_MAPPABLE = 0x08000022, 0x06040041
"""Abort codes (CiA 301)."""

FRAME_BITS = 64
TOLD = ((0x6040, 0), (0x6071, 0), (0x2100, 0))
"""Objects that a command may carry."""

CODES = (
    (DriveFault.STOP_LINE, 0x9001),
    (DriveFault.ENCODER, 0x7305),
    (DriveFault.TEMPERATURE, 0x4310),
    (DriveFault.CURRENT, 0x2310),
    (DriveFault.WATCHDOG, 0x8250),
    (DriveFault.INTERNAL, 0x6100),
)
"""Error code of each fault; the first that applies is sent (CiA 301, CiA 402)."""

FORMATS = {
    kinds.UNSIGNED8: "B",
    kinds.UNSIGNED16: "H",
    kinds.UNSIGNED32: "I",
    kinds.INTEGER8: "b",
    kinds.INTEGER16: "h",
    kinds.INTEGER32: "i",
}


class QuietNetwork(Network):
    """Network of all nodes, without a bus of its own and without threads."""

    def __init__(self, send: Callable[[int, bytes], None]):
        super().__init__()
        self._hand_on = send

    def send_message(self, can_id: int, data: bytes | bytearray | list[int], remote: bool = False) -> None:
        """Hand on an answer or a boot-up message."""
        self._hand_on(can_id, bytes(data))

    def send_periodic(self, can_id: int, data: bytes, period: float, remote: bool = False) -> Any:
        """Return a task without effect: each node sends its heartbeat itself, in its own time."""
        return _NoTask()


class _NoTask:
    def update(self, data: object) -> None:
        """Do nothing: the task has no data."""

    def stop(self) -> None:
        """Do nothing: the task has no thread."""


class MappedFrame:
    """Number and layout of a PDO frame, from the mapping that the host has written into the drive."""

    def __init__(self, node: LocalNode, index: int):
        number = _value(node, index, 1)
        self.is_valid = not number & INVALID
        self.cob, self.kind = number & 0x7FF, _value(node, index, 2)
        entries = [_value(node, index + 0x200, i + 1) for i in range(_value(node, index + 0x200, 0))]
        self.objects = tuple((entry >> 16, entry >> 8 & 0xFF) for entry in entries)
        formats = (FORMATS[node.object_dictionary.get_variable(*one).data_type] for one in self.objects)  # pyright: ignore[reportOptionalMemberAccess, reportArgumentType]
        self.layout = struct.Struct("<" + "".join(formats))


class SimulatedNode:
    """Simulated drive; each call passes the time. It sends by `send(cob, data)`, which may be disconnected."""

    def __init__(self, plant: Plant, joint: int, send: Callable[[int, bytes], None], without: frozenset[int]):
        self._plant, self._joint, self._send = plant, joint, send
        self._without = without if plant.measured.q_motor is not None else without | {ADDITIONAL_POSITION}
        self.drive = plant.each[joint]
        self.drive.watchdog_s = math.inf  # no host has set a watchdog yet
        self.local: Any = None
        self._getters: dict[tuple[int, int], Callable[[], int]] = {
            (0x603F, 0): lambda: _code(self._fault),
            (0x6041, 0): lambda: self._machine.state.value,
            (0x6061, 0): lambda: self._mode,
            (0x6064, 0): lambda: self._counts(plant.position(joint), self.drive.settings.counts_per_turn),
            (ADDITIONAL_POSITION, 1): lambda: self._counts(
                plant.motor_position(joint), self.drive.settings.motor_counts_per_turn
            ),
            (0x6075, 0): lambda: round(1000.0 * self.drive.settings.current_rated_A),
            (0x6077, 0): lambda: self._per_mille(plant.current(joint)),
            (0x2101, 0): lambda: round(10.0 * self.drive.temperature_C),
        }
        self.restart()

    def restart(self) -> None:
        """Start as after power-up: with the maker's settings, and pre-operational after the boot-up message."""
        self.local = LocalNode(self.drive.settings.node, object_dictionary(self._without))
        self.local.add_read_callback(self._read)
        self.local.add_write_callback(self._written)
        self._machine, self._mode = StateMachine(), 0
        self._told, self._syncs, self._fault = {}, 0, DriveFault.NONE
        self._heard_at, self._beats_at, self._pending = -math.inf, 0.0, False
        self.frames: tuple[MappedFrame, ...] = ()
        self.received: MappedFrame | None = None
        self.is_operational = False
        self.drive.disable()
        self.drive.fault, self.drive.watchdog_s = DriveFault.NONE, math.inf

    @property
    def number(self) -> int:
        """Node number of the drive."""
        return self.drive.settings.node

    def order(self, state: str) -> None:
        """Take the new NMT state."""
        self.is_operational = state == OPERATIONAL
        if self.is_operational:
            self.frames = tuple(one for index in SENT if (one := MappedFrame(self.local, index)).is_valid)
            told = MappedFrame(self.local, RECEIVED[0])
            self.received = told if told.is_valid else None
            self._syncs = 0

    def on_command(self, data: bytes, now: float) -> None:
        """Take a command frame. It acts at once, or with the next SYNC, depending on the transmission type."""
        frame = self.received
        if frame is None or not self.is_operational or len(data) < frame.layout.size:
            return
        self._told = dict(zip(frame.objects, frame.layout.unpack_from(data), strict=True))
        self._pending = frame.kind < AT_ONCE
        if not self._pending:
            self._obey(now)

    def on_sync(self, now: float) -> list[tuple[int, bytes]]:
        """Measure, and return the frames that are due."""
        if not self.is_operational:
            return []
        if self._pending:
            self._pending = False
            self._obey(now)
        self._syncs += 1
        return [
            (frame.cob, frame.layout.pack(*(self._getters[one]() for one in frame.objects)))
            for frame in self.frames
            if 1 <= frame.kind <= 240 and self._syncs % frame.kind == 0
        ]

    def on_heartbeat(self, node: int, now: float) -> None:
        """Note a heartbeat; the drive watches it from the first one on."""
        if _value(self.local, 0x1016, 1) >> 16 & 0xFF == node:
            self._heard_at = now

    def step(self, now: float) -> None:
        """End a step: publish the drive's own actions as state and emergency."""
        drive, machine = self.drive, self._machine
        patience = 1e-3 * (_value(self.local, 0x1016, 1) & 0xFFFF)
        if patience and now - self._heard_at > patience > 0.0 and self._heard_at > -math.inf:
            self._heard_at = -math.inf
            drive.starve(now)
        machine.end_quick_stop()
        if drive.fault != self._fault:
            self._say(drive.fault)
        if machine.state is not StatusState.OPERATION_ENABLED and drive.is_enabled:
            drive.disable()
        self._beat(now)

    def _obey(self, now: float) -> None:
        control = self._told.get((0x6040, 0), 0)
        if self._machine.control(control):
            if self.drive.acknowledge():
                self._machine.reset()
            self._say(self.drive.fault)
        if self._machine.state is StatusState.OPERATION_ENABLED:
            if not self.drive.is_enabled and not (self._mode == CYCLIC_TORQUE and self.drive.enable(now)):
                self._machine.state = StatusState.SWITCH_ON_DISABLED
        else:
            self.drive.disable()
        most = _value(self.local, 0x6072, 0)
        per_mille = min(max(self._told.get((0x6071, 0), 0), -most), most)
        current = 1e-3 * per_mille * self.drive.settings.current_rated_A
        self.drive.tell(current, 1e-3 * self._told.get((0x2100, 0), 0), now)

    def _say(self, fault: DriveFault) -> None:
        self._fault = fault
        code = _code(fault)
        if code:
            self._machine.fail()
        self._send(0x80 + self.number, struct.pack("<HB5x", code, bool(code)))

    def _beat(self, now: float) -> None:
        every = 1e-3 * _value(self.local, 0x1017, 0)
        if every and now >= self._beats_at:
            self._beats_at = now + every
            self._send(0x700 + self.number, bytes([0x05 if self.is_operational else 0x7F]))

    def _read(self, index: int, subindex: int, od: object) -> int | None:
        getter = self._getters.get((index, subindex))
        return None if getter is None else getter()

    def _written(self, index: int, subindex: int, od: object, data: bytes | bytearray) -> None:
        value = int.from_bytes(data, "little", signed=index == 0x6060)
        if index - 0x200 in (*RECEIVED, *SENT):
            self._check_mapping(index - 0x200, subindex, value)
        elif index == 0x6060:
            self._mode = value
        elif index == 0x1016:
            self._heard_at = -math.inf  # watched from the next heartbeat on
        elif (index, subindex) == (RECEIVED[0], 5):
            self.drive.watchdog_s = 1e-3 * value if value else math.inf

    def _check_mapping(self, parameters: int, sub: int, value: int) -> None:
        if not sub:
            entries = [_value(self.local, parameters + 0x200, i + 1) for i in range(min(value, MAPPED_MOST))]
            is_whole = value <= MAPPED_MOST and all(entries) and sum(entry & 0xFF for entry in entries) <= FRAME_BITS
            if not is_whole:
                raise SdoAbortedError(NOT_MAPPABLE)
        elif not self._is_open(parameters):
            raise SdoAbortedError(NOT_NOW)
        elif not self._can_map(value):
            raise SdoAbortedError(NOT_MAPPABLE)

    def _can_map(self, entry: int) -> bool:
        """Return True if the drive has this object, of this length, for a frame."""
        variable = self.local.object_dictionary.get_variable(entry >> 16, entry >> 8 & 0xFF)
        is_ours = (entry >> 16, entry >> 8 & 0xFF) in (*self._getters, *TOLD)
        return is_ours and variable is not None and len(variable) == entry & 0xFF

    def _is_open(self, parameters: int) -> bool:
        """Return True if a frame's mapping may be changed: the frame is invalid and maps no object (CiA 301)."""
        is_invalid = bool(_value(self.local, parameters, 1) & INVALID)
        return is_invalid and _value(self.local, parameters + 0x200, 0) == 0

    def _counts(self, rad: float, per_turn: float | None) -> int:
        return round(rad * (per_turn or 0.0) / (2.0 * math.pi))

    def _per_mille(self, current: float) -> int:
        return min(max(round(1000.0 * current / self.drive.settings.current_rated_A), -32768), 32767)


def _code(fault: DriveFault) -> int:
    return next((code for one, code in CODES if one in fault), 0)


def _value(node: Any, index: int, sub: int) -> int:
    """Value of one of a node's own unsigned objects; 0 if it has none."""
    stored = node.data_store.get(index, {}).get(sub)
    if stored is not None:
        return int.from_bytes(stored, "little")
    variable = node.object_dictionary.get_variable(index, sub)
    return 0 if variable is None else variable.default
