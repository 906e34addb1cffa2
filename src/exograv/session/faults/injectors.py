"""Faults as they enter a machine: between drives and guard, between control and guard, or in the world itself.

An injector sees what passes through the rig's own interface and may change it; nothing of it knows the twin but where
its docstring says so.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from exograv.rig.twin import Twin
from exograv.safety.guard import Submitted
from exograv.session.arm_controller import ArmController
from exograv.signals import Command, JointState

TICK_S = 0.001


@dataclass
class Injector:
    """Nothing at all; each fault changes what it is about, from its onset on."""

    generator: np.random.Generator
    joints: int
    onset: int
    """Tick of the run with which it begins [-]."""

    joint: int = field(init=False)
    """Which joint, where it is about one."""

    def __post_init__(self):
        self.joint = int(self.generator.integers(self.joints))
        self.draw()

    def draw(self) -> None:
        """Whatever else chance decides about it."""

    def measured(self, state: JointState, tick: int) -> JointState:
        """What the machine says in a tick, from the onset on."""
        return state

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        """What control submits in a tick, from the onset on."""
        return submitted

    def commanded(self, command: Command, tick: int) -> Command:
        """What reaches the drives in a tick, from the onset on."""
        return command

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        """What happens in the world or to control at the beginning of a tick, from the onset on."""

    def _at_joint(self, values: np.ndarray, change: Callable[[float], float]) -> np.ndarray:
        changed = values.copy()
        changed[self.joint] = change(changed[self.joint])
        return changed


class NotANumber(Injector):
    """F01: an encoder or a current sensor says NaN or infinity."""

    def draw(self) -> None:
        self.value = float(self.generator.choice([np.nan, np.inf, -np.inf]))
        self.what = str(self.generator.choice(["q", "current"]))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, **{self.what: self._at_joint(getattr(state, self.what), lambda _: self.value)})


class StuckEncoder(Injector):
    """F02: an encoder keeps what it said."""

    def draw(self) -> None:
        self.kept: float | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.kept is None:
            self.kept = float(state.q[self.joint])
        kept = self.kept
        return replace(state, q=self._at_joint(state.q, lambda _: kept))


class Spike(Injector):
    """F03: one position in one tick is far off."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(0.02, 2.0))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, q=self._at_joint(state.q, lambda q: q + self.size)) if tick == self.onset else state


class Jump(Spike):
    """F03: and stays there."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, q=self._at_joint(state.q, lambda q: q + self.size))


class Silent(Injector):
    """F04: the machine says nothing new."""

    def draw(self) -> None:
        self.last: JointState | None = None

    def measured(self, state: JointState, tick: int) -> JointState:
        if self.last is None:
            # The first measurement that does not come: the one before is still there.
            self.last = replace(state, sequence=state.sequence - 1)
        return self.last


class Stale(Injector):
    """F05: what the machine says is some milliseconds old."""

    def draw(self) -> None:
        self.late = int(self.generator.integers(4, 20))
        self.line: deque[JointState] = deque()

    def measured(self, state: JointState, tick: int) -> JointState:
        self.line.append(state)
        return self.line.popleft() if len(self.line) > self.late else replace(self.line[0], t=state.t - 0.004)


class Reordered(Injector):
    """F06: now and then two measurements change places."""

    def draw(self) -> None:
        self.every = int(self.generator.integers(150, 300))
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
        self.every = int(self.generator.integers(150, 300))
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
        return replace(state, q=self._at_joint(state.q, lambda q: 2.0 * start - q))


class Slip(Injector):
    """F08: an encoder slips on its shaft, by 3° to 20° within 20 to 100 ms."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * np.deg2rad(self.generator.uniform(3.0, 20.0)))
        self.ticks = int(self.generator.integers(20, 100))
        # No faster than a joint can move: what is faster is a jump.
        self.ticks = max(self.ticks, int(abs(self.size) / 0.006) + 1)

    def measured(self, state: JointState, tick: int) -> JointState:
        share = min((tick - self.onset + 1) / self.ticks, 1.0)
        return replace(state, q=self._at_joint(state.q, lambda q: q + share * self.size))


class TorqueConstant(Injector):
    """F09: a motor gives another torque for the same current, half to twice of it or the opposite."""

    def draw(self) -> None:
        self.factor = float(self.generator.choice([-1.0, 0.5, 2.0]))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=self._at_joint(command.current, lambda i: self.factor * i))

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, current=self._at_joint(state.current, lambda i: i / self.factor))


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
        return replace(state, current=self._at_joint(state.current, lambda i: i + bias))


class HiddenWeight(Injector):
    """F28: a kilogram that nobody has told of is put into the hand. Reaches into the twin's wearer."""

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            twin.hang("hand", 1.0)


class WeakMotor(Injector):
    """F11: a hot motor gives only a part of what it is told; its current says so."""

    def draw(self) -> None:
        self.share = float(self.generator.uniform(0.0, 0.3))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=self._at_joint(command.current, lambda i: self.share * i))


class DriveFault(Injector):
    """F12: a drive reports a fault and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, faulty=(self.joint,))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=self._at_joint(command.current, lambda _: 0.0))


class BusesLost(Silent):
    """F13: nothing comes from the machine, and nothing reaches it."""

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, valid_until=command.t - (tick - self.onset) * TICK_S)


class FewLate(Injector):
    """F14: control is late in one to three ticks."""

    def draw(self) -> None:
        self.count = int(self.generator.integers(1, 4))

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        return None if tick < self.onset + self.count else submitted


class ManyLate(Injector):
    """F14: control is late in every other tick."""

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        return None if (tick - self.onset) % 2 == 0 else submitted


class Hang(Injector):
    """F15: control goes on saying what it said last."""

    def draw(self) -> None:
        self.last: Submitted | None = None

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        self.last = self.last or submitted
        return self.last


class Killed(Injector):
    """F16: control is gone."""

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        return None


class GuardDies(Injector):
    """F17: nobody writes to the drives any more."""

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, valid_until=command.t - (tick - self.onset) * TICK_S)


class WrongTorque(Injector):
    """Control asks for torques that no controller should: not a number, huge, of the wrong sign, or trembling."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "huge", "sign", "tremble"]))

    def answered(self, submitted: Submitted | None, tick: int) -> Submitted | None:
        if submitted is None:
            return None
        change: dict[str, Callable[[float], float]] = {
            "nan": lambda _: np.nan,
            "huge": lambda tau: 1e3 * np.sign(tau),
            "sign": lambda tau: -tau,
            "tremble": lambda tau: tau + 40.0 * (-1.0) ** (tick // 5),
        }
        return replace(submitted, tau=self._at_joint(submitted.tau, change[self.kind]))


class TenfoldArm(Injector):
    """F25: the arm in force is ten times, 2.2 times or a tenth of the real one, past all checks of the form."""

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            x = controller.x
            x[: 10 * len(controller.assembly.arm.segments)] *= float(self.generator.choice([10.0, 2.2046, 0.1]))
            controller.put_in_force(x)


class Diverged(Injector):
    """F26: identification publishes what is no number, no body, or five times the arm, every 50 ms."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "impossible", "far"]))
        self.refused = 0

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if (tick - self.onset) % 50 == 0:
            x = controller.x.copy()
            bodies = slice(0, 10 * len(controller.assembly.arm.segments))
            x[bodies] *= {"nan": np.nan, "impossible": -1.0, "far": 5.0}[self.kind]
            self.refused += not controller.publish(x, twin.read().q)


class Push(Injector):
    """F29: the person pushes with 10 to 40 N·m for 50 to 400 ms. Reaches into the twin's wearer."""

    def draw(self) -> None:
        self.torque = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(10.0, 40.0))
        self.ticks = int(self.generator.integers(50, 400))

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if tick in (self.onset, self.onset + self.ticks):
            sign = 1.0 if tick == self.onset else -1.0
            twin.tau_voluntary[self.joint] += sign * self.torque


class StopPressed(Injector):
    """F30: somebody presses Stop; the flight tells the guard."""


class StopLineOpen(Injector):
    """F39: the line of the hardware stop is open: every drive says so and gives no torque."""

    def measured(self, state: JointState, tick: int) -> JointState:
        return replace(state, faulty=tuple(range(self.joints)))

    def commanded(self, command: Command, tick: int) -> Command:
        return replace(command, current=np.zeros_like(command.current))
