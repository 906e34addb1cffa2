"""What the person does."""

from exograv.rig.twin import Twin
from exograv.session.arm_controller import ArmController

from .injector import Injector


class Push(Injector):
    """F29: the person pushes with 10 to 40 N·m for 50 to 400 ms. Reaches into the twin's wearer."""

    def draw(self) -> None:
        self.torque = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(10.0, 40.0))
        self.ticks = int(self.generator.integers(50, 400))

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if tick in (self.onset, self.onset + self.ticks):
            sign = 1.0 if tick == self.onset else -1.0
            twin.tau_voluntary[self.joint] += sign * self.torque

    def pushes(self, tick: int) -> bool:
        return self.onset <= tick < self.onset + self.ticks


class HiddenWeight(Injector):
    """F28: a kilogram that nobody has told of is put into the hand. Reaches into the twin's wearer."""

    def act(self, twin: Twin, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            twin.hang("hand", 1.0)


class StopPressed(Injector):
    """F30: somebody presses Stop; the flight tells the guard."""
