"""Simulated moteus: modes, registers and settings; `SimulatedDrive` computes its output to the motor.

Its behaviour follows the firmware (mjbots moteus, fw/bldc_servo_control.h). The watchdog runs in position mode only,
and only a stop leaves the mode after it. A fault or a stop lets go of the motor. Shorted windings brake in mode 15,
and after the watchdog if servo.timeout_mode is set so.
"""

import math

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.simulated.plant import Plant

from . import registers as at
from .registers import Number, Subframe, reply, subframes, varuint

STOPPED, FAULT, BEGINS, POSITION, TIMEOUT, BRAKE = 0, 1, 2, 10, 11, 15
BEGINS_S = 0.012
"""Time from stopped to any other mode, in which the drive finds the zero of its current sensors [s]."""

CODES = (
    (DriveFault.TEMPERATURE, 38),
    (DriveFault.STOP_LINE, 40),
    (DriveFault.ENCODER, 35),
    (DriveFault.CURRENT, 33),
    (DriveFault.INTERNAL, 46),
)
"""Codes of the maker; the first that applies is reported."""

DEFAULTS = {
    at.TO_POSITION: 0.0, at.TO_VELOCITY: 0.0, at.FEEDFORWARD: 0.0, at.KP_SCALE: 1.0, at.KD_SCALE: 1.0,
    at.MOST_TORQUE: math.nan, at.TIMEOUT: 0.0,
}  # fmt: skip
"""Values of an order's missing fields."""

ON_OUTPUT, FIRMWARE, MAP, SUPPLY_V = 2, 0x010100, 5, 24.0
KV_Nm_PER_A = 1.5 * (30.0 / math.pi) / math.sqrt(3.0)
"""Torque constant [N·m/A] times Kv [1/min/V]: 3/2 of the flux of a phase, while Kv refers to the line voltage."""

UNMEASURED_Nm_PER_A = 0.1
"""Torque constant of a motor without Kv [N·m/A]."""

RATIOS = (0.03125, 0.025, 0.02, 0.04)
"""Gear ratios, made up; numbers that six printed digits represent exactly."""


class SimulatedMoteus:
    """Drive of one joint. The Kv and gear ratio of its motor are made up, and differ from joint to joint."""

    def __init__(self, plant: Plant, drives: Drives, joint: int):
        self.joint, self.number = joint, drives.each[joint].node
        self._plant, self._drive, self._plate = plant, plant.each[joint], drives.each[joint]
        self.config = settings(drives, joint)
        self.mode, self._code, self._begun, self.home = STOPPED, 0, 0.0, ON_OUTPUT
        self._order: dict[int, Number] = {}
        self._turns = self._speed = 0.0
        self._line = self._said = b""
        self.was_asked = False
        """True if a host has read a setting since this was set to False."""
        self._drive.brake_Nms_per_rad = 0.0

    def receive(self, data: bytes, now: float) -> bytes:
        """Process a frame; return the answer, which is sent if the host wants one."""
        answer, order = b"", None
        for one in subframes(data):
            if one.kind == at.WRITE:
                for register, value in enumerate(one.values, one.first):
                    if register == at.MODE:
                        order = {**DEFAULTS, at.MODE: value}
                    elif order is not None:
                        order[register] = value
            elif one.kind == at.READ:
                answer += self._read(one)
            else:
                answer += self._stream(one)
        if order is not None:
            self._obey(order, now)
        return answer

    def step(self, dt: float, now: float) -> None:
        """Update modes and faults after a step of the plant."""
        turns = self._plant.position(self.joint) / (2.0 * math.pi)
        self._turns, self._speed = turns, (turns - self._turns) / dt
        if self.mode == BEGINS and now >= self._begun + BEGINS_S:
            self._enter(now)
        fault = self._drive.fault
        if fault is DriveFault.WATCHDOG and self.mode == POSITION:
            self.mode = TIMEOUT
            self._brake(self.config["servo.timeout_mode"] == BRAKE)
        elif fault & ~DriveFault.WATCHDOG and self.mode not in (STOPPED, FAULT):
            self._fail()

    def _brake(self, is_shorted: bool) -> None:
        self._drive.brake_Nms_per_rad = self._plate.brake_Nms_per_rad if is_shorted else 0.0

    def _fail(self) -> None:
        fault = self._drive.fault
        self.mode, self._code = FAULT, next(code for one, code in CODES if one in fault)
        self._brake(False)

    def _obey(self, order: dict[int, Number], now: float) -> None:
        if order[at.MODE] == STOPPED:
            self.mode, self._code = STOPPED, 0
            self._drive.disable()
            self._drive.acknowledge()
            self._brake(False)
        elif order[at.MODE] in (POSITION, BRAKE) and self.mode not in (FAULT, TIMEOUT):
            self._order = order
            if self.mode == STOPPED:
                self.mode, self._begun = BEGINS, now
            elif self.mode != BEGINS:
                self._enter(now)

    def _enter(self, now: float) -> None:
        drive, order = self._drive, self._order
        if not drive.acknowledge():
            self._fail()
            return
        self.mode = int(order[at.MODE])
        self._brake(self.mode == BRAKE)
        if self.mode == BRAKE:
            drive.disable()
            return
        drive.enable(now)
        timeout = order[at.TIMEOUT] or self.config["servo.default_timeout_s"]
        drive.watchdog_s = math.inf if math.isnan(timeout) else timeout
        damping = order[at.KD_SCALE] * self.config["servo.pid_position.kd"] / (2.0 * math.pi)
        drive.tell(self._torque(order) / self._per_ampere, damping, now)

    def _torque(self, order: dict[int, Number]) -> float:
        """Torque at the output without damping [N·m]."""
        to = order[at.TO_POSITION]
        held = 0.0 if math.isnan(to) else order[at.KP_SCALE] * self.config["servo.pid_position.kp"] * (to - self._turns)
        most = order[at.MOST_TORQUE]
        most = math.inf if math.isnan(most) else most
        return min(max(order[at.FEEDFORWARD] + held, -most), most)

    @property
    def _per_ampere(self) -> float:
        kv = self.config["motor.Kv"]
        return (KV_Nm_PER_A / kv if kv else UNMEASURED_Nm_PER_A) / self.config["motor_position.rotor_to_output_ratio"]

    def _read(self, asked: Subframe) -> bytes:
        current = self._plant.current(self.joint)
        supply = 0.0 if DriveFault.STOP_LINE in self._drive.fault else SUPPLY_V
        has = {
            at.MODE: self.mode, at.POSITION: self._plant.position(self.joint) / (2.0 * math.pi),
            at.VELOCITY: self._speed, at.TORQUE: current * self._per_ampere, at.CURRENT: current,
            at.HOME: self.home, at.VOLTAGE: supply, at.TEMPERATURE: self._drive.temperature_C, at.FAULT: self._code,
            at.FIRMWARE: FIRMWARE, at.MAP: MAP,
        }  # fmt: skip
        registers = range(asked.first, asked.first + asked.n)
        if any(register not in has for register in registers):
            return bytes((at.READ_ERROR,)) + varuint(asked.first) + b"\x01"
        return reply(asked.type, asked.first, [has[register] for register in registers])

    def _stream(self, one: Subframe) -> bytes:
        if one.kind == at.TO_DRIVE:
            *lines, self._line = (self._line + one.text).split(b"\n")
            for line in lines:
                self._said += self._console(line.decode("latin-1").split())
            return b""
        said, self._said = self._said[: one.first], self._said[one.first :]
        return bytes((at.FROM_DRIVE,)) + varuint(one.type) + varuint(len(said)) + said

    def _console(self, words: list[str]) -> bytes:
        if words[:1] != ["conf"] or len(words) < 3 or words[2] not in self.config:
            return b"ERR unknown\r\n"
        name, value = words[2], self.config[words[2]]
        self.was_asked = True
        if words[1] == "set":
            self.config[name] = float(words[3])
            return b"OK\r\n"
        return (f"{value}" if isinstance(value, int) else f"{value:f}").encode() + b"\r\nOK\r\n"


def settings(drives: Drives, joint: int) -> dict[str, Number]:
    """Return the settings, by the maker's names, that make a drive agree with `drives.toml`."""
    plate, kv, ratio = drives.each[joint], 90.0 + 15.0 * joint, RATIOS[joint % len(RATIOS)]
    per_ampere = KV_Nm_PER_A / kv / ratio
    brake = plate.brake_Nms_per_rad
    return {
        "id.id": plate.node,
        "motor.Kv": kv,
        "motor.resistance_ohm": per_ampere**2 / (1.5 * brake) if brake else 0.1,
        "motor.rotation_current_cutoff_A": 10000.0,
        "motor_position.rotor_to_output_ratio": ratio,
        "servo.max_current_A": plate.current_max_A,
        "servo.default_timeout_s": drives.watchdog_s,
        "servo.timeout_mode": BRAKE if brake else STOPPED,
        "servo.pid_position.kp": 0.0,
        "servo.pid_position.ki": 0.0,
        "servo.pid_position.kd": 6.0,
        "servopos.position_min": math.nan,
        "servopos.position_max": math.nan,
        "servo.bemf_feedforward": 0.0,
        "servo.voltage_mode_control": 0,
        "servo.fixed_voltage_mode": 0,
        "servo.fault_position_error": math.nan,
    }
