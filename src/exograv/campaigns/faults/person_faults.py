"""Acts of the person: pushes, hidden weights, the Stop button."""

from exograv.loop.arm_controller import ArmController

from .fault_plant import World
from .injector import Injector


class PersonPush(Injector):
    """F29: the person pushes with 10 to 40 N·m for 50 to 400 ms."""

    def draw(self) -> None:
        self.torque = float(self.generator.choice([-1.0, 1.0]) * self.generator.uniform(10.0, 40.0))
        self.lasts = self.ticks(int(self.generator.integers(50, 400)))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick in (self.onset, self.onset + self.lasts):
            sign = 1.0 if tick == self.onset else -1.0
            world.push(self.joint, sign * self.torque)

    def pushes(self, tick: int) -> bool:
        return self.onset <= tick < self.onset + self.lasts


class HiddenWeight(Injector):
    """F28: a kilogram is put into the hand without telling the software."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.hang("hand", 1.0)


class StopPressed(Injector):
    """F30: the Stop button is pressed."""
