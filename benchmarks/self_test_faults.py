"""Hidden faults that a self-test must find: machines and drivers with a fault that the software is not told of.

The calibration is from the day before, when the machine was healthy. The test has no access to this module.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType, TracebackType

import numpy as np

from exograv.rig import Rig
from exograv.rig.twin import Machine
from exograv.safety.guard import Guard
from exograv.signals import Command, JointState

BIAS_NM = 2.5
LATE_TICKS = 6


@dataclass
class Driver:
    """`Rig` between the computer and the machine, as yet without a fault."""

    rig: Rig
    joint: int
    """Index of the faulty joint, if the fault is at one joint."""

    gain: np.ndarray
    """Torque per current (joint,) [N·m/A], to give a torque's error as a current."""

    is_pressed: bool = field(default=False, init=False)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the machine's joints."""
        return self.rig.joints

    @property
    def period_s(self) -> float:
        """Period of the machine [s]."""
        return self.rig.period_s

    @property
    def t(self) -> float:
        """Time on the machine's clock [s]."""
        return self.rig.t

    def read(self) -> JointState:
        """Return the state of the machine."""
        return self.rig.read()

    def write(self, command: Command) -> None:
        """Pass the command to the machine."""
        self.rig.write(command)

    def press(self, guard: Guard) -> None:
        """Press Stop at the guard."""
        self.is_pressed = True
        guard.press_stop()

    def __enter__(self) -> "Driver":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def _at(self, values: np.ndarray, change: Callable[[float], float]) -> np.ndarray:
        changed = values.copy()
        changed[self.joint] = change(float(changed[self.joint]))
        return changed


@dataclass
class Turned(Driver):
    """Driver that changes the positions of a joint: its own encoder's (`own`), its motor's (not `own`), or `both`."""

    sign: float = 1.0
    shift: float = 0.0
    own: bool = True
    both: bool = False

    def read(self) -> JointState:
        """Return the state with the position changed."""
        state = self.rig.read()
        q_motor = state.q_motor
        if q_motor is not None and (self.both or not self.own):
            q_motor = self._at(q_motor, self._changed)
        return state._replace(q=self._at(state.q, self._changed) if self.own else state.q, q_motor=q_motor)

    def _changed(self, q: float) -> float:
        return self.sign * q + self.shift


@dataclass
class Biased(Driver):
    """Driver with a wrong current zero. With `within_loop` the motor also gets less current, and the state hides it."""

    within_loop: bool = False

    def read(self) -> JointState:
        """Return the state with the current changed."""
        state, by = self.rig.read(), BIAS_NM / self.gain[self.joint]
        return state._replace(current=self._at(state.current, lambda current: current + by))

    def write(self, command: Command) -> None:
        """Pass the command with the current that the drive's loop takes off."""
        by = BIAS_NM / self.gain[self.joint] if self.within_loop else 0.0
        self.rig.write(command._replace(current=self._at(command.current, lambda current: current - by)))


class KeepsOn(Driver):
    """Driver whose commands never expire: the last command stays in force."""

    def write(self, command: Command) -> None:
        """Pass the command as if it had just arrived."""
        self.rig.write(command._replace(t=self.rig.t, valid_until=self.rig.t + 0.005))


class DeafStop(Driver):
    """Driver with a cut line of the Stop button."""

    def press(self, guard: Guard) -> None:
        """Ignore the button."""


@dataclass
class StopNotPassedOn(Driver):
    """Driver that ignores Stop: the guard gets Stop, and the drives keep the command from before."""

    last: Command | None = None

    def write(self, command: Command) -> None:
        """Pass the last command from before Stop."""
        if self.last is None or not self.is_pressed:
            self.last = command
        self.rig.write(self.last._replace(t=command.t, valid_until=command.valid_until))


@dataclass
class Late(Driver):
    """Driver whose measurements come some milliseconds late, with their true times."""

    line: deque[JointState] = field(default_factory=deque)

    def read(self) -> JointState:
        """Return an earlier state."""
        state = self.rig.read()
        if not self.line or self.line[-1].sequence != state.sequence:
            self.line.append(state)
        while len(self.line) > LATE_TICKS:
            self.line.popleft()
        return self.line[0]


@dataclass
class Dead(Driver):
    """Driver with a dead encoder: it keeps its value from when the machine was switched on."""

    kept: float | None = None

    def read(self) -> JointState:
        """Return the state with the first position."""
        state = self.rig.read()
        kept = self.kept = float(state.q[self.joint]) if self.kept is None else self.kept
        return state._replace(q=self._at(state.q, lambda _: kept))


@dataclass
class Swapped(Driver):
    """Driver that swaps two joints: their encoders, their motors, or both."""

    encoders: bool = False
    motors: bool = False

    def read(self) -> JointState:
        """Return the state in the other order."""
        state = self.rig.read()
        q_motor = state.q_motor
        if self.encoders:
            q_motor = None if q_motor is None else self._other(q_motor)
            state = state._replace(q=self._other(state.q), q_motor=q_motor)
        return state._replace(current=self._other(state.current)) if self.motors else state

    def write(self, command: Command) -> None:
        """Pass the command in the other order."""
        current = self._other(command.current) if self.motors else command.current
        self.rig.write(command._replace(current=current))

    def _other(self, values: np.ndarray) -> np.ndarray:
        order = np.arange(len(values))
        other = (self.joint + 1) % len(values)
        order[[self.joint, other]] = [other, self.joint]
        return values[order]


MachineOf = Callable[[Machine, int], Machine]
DriverOf = Callable[[Rig, int, np.ndarray], Driver]


@dataclass(frozen=True)
class Hidden:
    """Kind of fault."""

    fault: str
    """Number of the fault in docs/explanation/safety.md."""

    machine: MachineOf = lambda machine, _joint: machine
    driver: DriverOf = Driver


def gain(factor: float) -> Hidden:
    """Fault: a motor gives another torque for the same current, and the measured current hides it."""

    def change(machine: Machine, joint: int) -> Machine:
        gains = machine.drives.gain.copy()
        gains[joint] *= factor
        return replace(machine, drives=replace(machine.drives, gain=gains))

    return Hidden("F09", change)


def does_not_brake(machine: Machine, joint: int) -> Machine:
    """Machine with a drive whose watchdog only lets go and does not brake."""
    damping = machine.drives.watchdog_damping.copy()
    damping[joint] = 0.0
    return replace(machine, drives=replace(machine.drives, watchdog_damping=damping))


def turned(fault: str, sign: float = 1.0, shift_deg: float = 0.0, own: bool = True, both: bool = False) -> Hidden:
    """Fault: positions are reversed or shifted."""
    shift = float(np.deg2rad(shift_deg))
    return Hidden(fault, driver=lambda rig, joint, gains: Turned(rig, joint, gains, sign, shift, own, both))


HIDDEN: Mapping[str, Hidden] = MappingProxyType(
    {
        "motor gives half its torque": gain(0.5),
        "motor gives twice its torque": gain(2.0),
        "motor turns the other way": gain(-1.0),
        "encoder reversed": turned("F07", -1.0),
        "both encoders reversed": turned("F07", -1.0, both=True),
        "encoder off by 5°": turned("F08", shift_deg=5.0),
        "encoder off by 10°": turned("F08", shift_deg=10.0),
        "both encoders off by 5°": turned("F08", shift_deg=5.0, both=True),
        "both encoders off by 10°": turned("F08", shift_deg=10.0, both=True),
        "motor's encoder off by 5°": turned("F08", shift_deg=5.0, own=False),
        "current sensor off by 2.5 N·m": Hidden("F10", driver=Biased),
        "current loop off by 2.5 N·m": Hidden("F10", driver=lambda *of: Biased(*of, within_loop=True)),
        "watchdog does not trip": Hidden("F13", driver=KeepsOn),
        "watchdog does not brake": Hidden("F13", does_not_brake),
        "Stop does nothing": Hidden("F30", driver=DeafStop),
        "Stop does not reach the drives": Hidden("F30", driver=StopNotPassedOn),
        "measurements come late": Hidden("F05", driver=Late),
        "encoder is dead": Hidden("F02", driver=Dead),
        "encoders swapped": Hidden("–", driver=lambda *of: Swapped(*of, encoders=True)),
        "motors swapped": Hidden("–", driver=lambda *of: Swapped(*of, motors=True)),
        "joints swapped": Hidden("–", driver=lambda *of: Swapped(*of, encoders=True, motors=True)),
    }
)
"""Faults by their name in tables."""
