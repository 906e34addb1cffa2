"""Faults of control and of its arm parameters."""

from collections.abc import Callable

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.safety.guard import ControlRequest

from .fault_plant import World
from .injector import Injector


class OccasionalLateTicks(Injector):
    """F14: control is late in one to three ticks."""

    def draw(self) -> None:
        self.count = self.ticks(int(self.generator.integers(1, 4)))

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None if tick < self.onset + self.count else submitted


class RepeatedLateTicks(Injector):
    """F14: control is late in every other tick."""

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None if (tick - self.onset) % 2 == 0 else submitted


class Hang(Injector):
    """F15: control repeats its last answer."""

    def draw(self) -> None:
        self.last: ControlRequest | None = None

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        self.last = self.last or submitted
        return self.last


class ControlKilled(Injector):
    """F16: control stops answering."""

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None


class WrongTorque(Injector):
    """Control asks for faulty torques: NaN, huge, of the wrong sign, or oscillating."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "huge", "sign", "tremble"]))

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        if submitted is None:
            return None
        change: dict[str, Callable[[float], float]] = {
            "nan": lambda _: np.nan,
            "huge": lambda tau: 1e3 * np.sign(tau),
            "sign": lambda tau: -tau,
            "tremble": lambda tau: tau + 40.0 * (-1.0) ** (tick // self.ticks(5)),
        }
        return submitted._replace(tau=self.at_joint(submitted.tau, change[self.kind]))


class WrongArmParameters(Injector):
    """F25: the arm parameters in force are 10, 2.2 or 0.1 times the real ones, and pass all checks."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            x = controller.x
            x[: 10 * len(controller.assembly.arm.segments)] *= float(self.generator.choice([10.0, 2.2046, 0.1]))
            controller.put_in_force(x)


class DivergedEstimate(Injector):
    """F26: identification publishes NaN, an impossible body, or five times the arm, every 50 ms."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "impossible", "far"]))
        self.refused = 0

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if (tick - self.onset) % self.ticks(50) == 0:
            x = controller.x.copy()
            bodies = slice(0, 10 * len(controller.assembly.arm.segments))
            x[bodies] *= {"nan": np.nan, "impossible": -1.0, "far": 5.0}[self.kind]
            self.refused += not controller.publish(x, world.q)
