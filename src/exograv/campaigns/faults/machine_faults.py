"""Faults of sensors, drives, lines, and of the guard itself."""

from collections import deque
from dataclasses import replace

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.safety.monitors import TORQUE_OFF_NM
from exograv.signals import Command, JointState

from .fault_plant import World
from .injector import TICK_S, Injector

NOISE_SD = 3.0
"""Of the current's noise, beyond which ten ticks in a row come together [-]."""


class NonFiniteMeasurement(Injector):
    """F01: an encoder or a current sensor says NaN or infinity."""

    def draw(self) -> None:
        self.value = float(self.generator.choice([np.nan, np.inf, -np.inf]))
        self.what = str(self.generator.choice(["q", "current"]))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, **{self.what: self.at_joint(getattr(state, self.what), lambda _: self.value)})


class StuckEncoder(Injector):
    """F02: an encoder keeps what it said."""

    def draw(self) -> None:
        self.kept: float | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.kept is None:
            self.kept = float(state.q[self.joint])
        kept = self.kept
        return replace(state, q=self.at_joint(state.q, lambda _: kept))


class EncoderSpike(Injector):
    """F03: one position in one tick is far off."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(0.02, 2.0))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, q=self.at_joint(state.q, lambda q: q + self.size)) if tick == self.onset else state


class EncoderJump(EncoderSpike):
    """F03: and stays there."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, q=self.at_joint(state.q, lambda q: q + self.size))


class FrozenMeasurement(Injector):
    """F04: the machine says nothing new."""

    def draw(self) -> None:
        self.last: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.last is None:
            # The first measurement that does not come: the one before is still there.
            self.last = replace(state, sequence=state.sequence - 1)
        return self.last


class DelayedMeasurement(Injector):
    """F05: what the machine says is some milliseconds old."""

    def draw(self) -> None:
        self.late = self.ticks(int(self.generator.integers(4, 20)))
        self.line: deque[JointState] = deque()

    def measured(self, state: JointState, tick: int) -> JointState:
        self.line.append(state)
        return self.line.popleft() if len(self.line) > self.late else replace(self.line[0], t=state.t - 0.004)


class ReorderedMeasurement(Injector):
    """F06: now and then two measurements change places."""

    def draw(self) -> None:
        self.every = self.ticks(int(self.generator.integers(150, 300)))
        self.held: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if (tick - self.onset) % self.every == 0:
            self.held = state
            return replace(state, sequence=state.sequence - 1)
        if self.held is not None:
            late, self.held = self.held, None
            return late
        return state


class Doubled(Injector):
    """F06: now and then a measurement comes twice."""

    def draw(self) -> None:
        self.every = self.ticks(int(self.generator.integers(150, 300)))
        self.before: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        before, self.before = self.before, state
        return before if before is not None and (tick - self.onset) % self.every == 0 else state


class SignFlip(Injector):
    """F07: from one tick to the next an encoder counts the other way."""

    def draw(self) -> None:
        self.start: float | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.start is None:
            self.start = float(state.q[self.joint])
        start = self.start
        return replace(state, q=self.at_joint(state.q, lambda q: 2.0 * start - q))


class EncoderSlip(Injector):
    """F08: an encoder slips on its shaft, by 3° to 20° within 20 to 100 ms."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * np.deg2rad(self.generator.uniform(3.0, 20.0)))
        ms = int(self.generator.integers(20, 100))
        # No faster than a joint can move: what is faster is a jump.
        self.lasts = self.ticks(max(ms, int(abs(self.size) / 0.006) + 1))

    def measured(self, state: JointState, tick: int) -> JointState:
        share = min((tick - self.onset + 1) / self.lasts, 1.0)
        return replace(state, q=self.at_joint(state.q, lambda q: q + share * self.size))


class TorqueConstant(Injector):
    """F09: a motor gives another torque for the same current, half to twice of it or the opposite."""

    def draw(self) -> None:
        self.factor = float(self.generator.choice([-1.0, 0.5, 2.0]))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.turn_motor(self.joint, self.factor)

    def commanded(self, command: Command, tick: int) -> Command:
        flowing = self.at_joint(command.current, lambda i: self.factor * i)
        if command.damping is None:
            return replace(command, current=flowing)
        # A motor whose phases are shorted brakes by the square of its constant; stronger it is not counted on.
        brake = min(self.factor**2, 1.0)
        return replace(command, current=flowing, damping=self.at_joint(command.damping, lambda d: brake * d))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, current=self.at_joint(state.current, lambda i: i / self.factor))


class CurrentBias(Injector):
    """F10: a current sensor says 2.5 to 6 N·m more or less than there is."""

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
        return replace(state, current=self.at_joint(state.current, lambda i: i + bias))


class WeakMotor(Injector):
    """F11: a hot motor gives only a part of what it is told; its current says so."""

    def draw(self) -> None:
        self.share = float(self.generator.uniform(0.0, 0.3))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=self.at_joint(command.current, lambda i: self.share * i))

    def shows(self, told: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """While so much is missing that noise cannot hide it: a motor that is told little gives little."""
        missing = (1.0 - self.share) * np.abs(told[:, self.joint])
        return super().shows(told, noise_Nm) & (missing > TORQUE_OFF_NM + NOISE_SD * noise_Nm[self.joint])


class ReportedDriveFault(Injector):
    """F12: a drive reports a fault and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, faulty=(self.joint,))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=self.at_joint(command.current, lambda _: 0.0))


class BusesLost(FrozenMeasurement):
    """F13: nothing comes from the machine, and nothing reaches it."""

    def draw(self) -> None:
        super().draw()
        self.last_command: Command | None = None

    def commanded(self, command: Command, tick: int) -> Command:
        # The drives know it no longer than the last one that reached them.
        self.last_command = self.last_command or replace(command, valid_until=command.valid_until - TICK_S)
        return self.last_command


class GuardDies(Injector):
    """F17: nobody writes to the drives any more."""

    ends_guard = True


class StopLineOpen(Injector):
    """F39: the line of the hardware stop is open: every drive says so and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, faulty=tuple(range(self.joints)))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=np.zeros_like(command.current))
