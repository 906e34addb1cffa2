"""Faults of sensors, drives, cables, and of the guard itself."""

from collections import deque

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.safety.native.core import TORQUE_OFF_NM
from exograv.signals import Command, JointState

from .fault_plant import World
from .injector import TICK_S, Injector

NOISE_SD = 3.0
"""Margin above the guard's threshold, in standard deviations of the current's noise [-]. With this margin the torque
error of ten ticks in a row exceeds the threshold."""


class NonFiniteMeasurement(Injector):
    """F01: an encoder or a current sensor reports NaN or infinity."""

    def draw(self) -> None:
        self.value = float(self.generator.choice([np.nan, np.inf, -np.inf]))
        self.what = str(self.generator.choice(["q", "current"]))

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(**{self.what: self.at_joint(getattr(state, self.what), lambda _: self.value)})


class StuckEncoder(Injector):
    """F02: an encoder repeats its last value."""

    def draw(self) -> None:
        self.kept: float | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.kept is None:
            self.kept = float(state.q[self.joint])
        kept = self.kept
        return state._replace(q=self.at_joint(state.q, lambda _: kept))

    def shows(self, told: np.ndarray, moves: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """Ticks in which the joint moves. While it stands still, its measurements look normal."""
        return super().shows(told, moves, noise_Nm) & moves[:, self.joint]


class EncoderSpike(Injector):
    """F03: a position is far off in one tick."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(0.02, 2.0))

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(q=self.at_joint(state.q, lambda q: q + self.size)) if tick == self.onset else state


class EncoderJump(EncoderSpike):
    """F03: a position jumps and stays there."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(q=self.at_joint(state.q, lambda q: q + self.size))


class FrozenMeasurement(Injector):
    """F04: the machine repeats its last measurement."""

    def draw(self) -> None:
        self.last: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.last is None:
            # The first missing measurement: the rig still returns the one before.
            self.last = state._replace(sequence=state.sequence - 1)
        return self.last


class DelayedMeasurement(Injector):
    """F05: measurements are several milliseconds old."""

    def draw(self) -> None:
        self.late = self.ticks(int(self.generator.integers(4, 20)))
        self.line: deque[JointState] = deque()

    def measured(self, state: JointState, tick: int) -> JointState:
        self.line.append(state)
        return self.line.popleft() if len(self.line) > self.late else self.line[0]._replace(t=state.t - 0.004)


class ReorderedMeasurement(Injector):
    """F06: two measurements swap places from time to time."""

    def draw(self) -> None:
        self.every = self.ticks(int(self.generator.integers(150, 300)))
        self.held: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if (tick - self.onset) % self.every == 0:
            self.held = state
            return state._replace(sequence=state.sequence - 1)
        if self.held is not None:
            late, self.held = self.held, None
            return late
        return state


class Doubled(Injector):
    """F06: a measurement comes twice from time to time."""

    def draw(self) -> None:
        self.every = self.ticks(int(self.generator.integers(150, 300)))
        self.before: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        before, self.before = self.before, state
        return before if before is not None and (tick - self.onset) % self.every == 0 else state


class SignFlip(Injector):
    """F07: an encoder reverses its counting direction from one tick to the next."""

    def draw(self) -> None:
        self.start: float | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.start is None:
            self.start = float(state.q[self.joint])
        start = self.start
        return state._replace(q=self.at_joint(state.q, lambda q: 2.0 * start - q))

    def shows(self, told: np.ndarray, moves: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """Ticks in which the joint moves. While it stands still, its measurements look normal."""
        return super().shows(told, moves, noise_Nm) & moves[:, self.joint]


class EncoderSlip(Injector):
    """F08: an encoder slips on its shaft, by 3° to 20° within 20 to 100 ms."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * np.deg2rad(self.generator.uniform(3.0, 20.0)))
        ms = int(self.generator.integers(20, 100))
        # The slip stays slower than the fastest joint; a faster one would be a jump (F03).
        self.lasts = self.ticks(max(ms, int(abs(self.size) / 0.006) + 1))

    def measured(self, state: JointState, tick: int) -> JointState:
        share = min((tick - self.onset + 1) / self.lasts, 1.0)
        return state._replace(q=self.at_joint(state.q, lambda q: q + share * self.size))


class TorqueConstant(Injector):
    """F09: a motor gives half, double or reversed torque for the same current."""

    def draw(self) -> None:
        self.factor = float(self.generator.choice([-1.0, 0.5, 2.0]))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.turn_motor(self.joint, self.factor)

    def commanded(self, command: Command, tick: int) -> Command:
        flowing = self.at_joint(command.current, lambda i: self.factor * i)
        if command.damping is None:
            return command._replace(current=flowing)
        # A motor with shorted phases brakes with the square of its constant. No extra braking is assumed.
        brake = min(self.factor**2, 1.0)
        return command._replace(current=flowing, damping=self.at_joint(command.damping, lambda d: brake * d))

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(current=self.at_joint(state.current, lambda i: i / self.factor))


class CurrentBias(Injector):
    """F10: a current sensor reads 2.5 to 6 N·m too much or too little."""

    def draw(self) -> None:
        self.bias_Nm = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(2.5, 6.0))
        self.gain: float | None = None

    def commanded(self, command: Command, tick: int) -> Command:
        current = float(command.current[self.joint])
        self.gain = float(command.tau[self.joint]) / current if current else self.gain
        return command

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.gain is None:
            return state
        bias = self.bias_Nm / self.gain
        return state._replace(current=self.at_joint(state.current, lambda i: i + bias))


class WeakMotor(Injector):
    """F11: a hot motor gives only a part of the commanded torque, and its current shows it."""

    def draw(self) -> None:
        self.share = float(self.generator.uniform(0.0, 0.3))

    def commanded(self, command: Command, tick: int) -> Command:
        return command._replace(current=self.at_joint(command.current, lambda i: self.share * i))

    def shows(self, told: np.ndarray, moves: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """Ticks in which the missing torque exceeds the noise. With a small command, little torque is missing."""
        missing = (1.0 - self.share) * np.abs(told[:, self.joint])
        return super().shows(told, moves, noise_Nm) & (missing > TORQUE_OFF_NM + NOISE_SD * noise_Nm[self.joint])


class ReportedDriveFault(Injector):
    """F12: a drive reports a fault and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(faulty=(self.joint,))

    def commanded(self, command: Command, tick: int) -> Command:
        return command._replace(current=self.at_joint(command.current, lambda _: 0.0))


class BusesLost(FrozenMeasurement):
    """F13: no measurement comes from the machine, and no command reaches it."""

    def draw(self) -> None:
        super().draw()
        self.last_command: Command | None = None

    def commanded(self, command: Command, tick: int) -> Command:
        # The last command that reached the drives is one tick older, so it expires one tick earlier.
        self.last_command = self.last_command or command._replace(valid_until=command.valid_until - TICK_S)
        return self.last_command


class GuardDies(Injector):
    """F17: the drives receive no more commands."""

    ends_guard = True


class StopLineOpen(Injector):
    """F39: the line of the hardware stop opens: every drive reports it and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(faulty=tuple(range(self.joints)))

    def commanded(self, command: Command, tick: int) -> Command:
        return command._replace(current=np.zeros_like(command.current))
