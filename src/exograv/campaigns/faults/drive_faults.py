"""Faults injected at the simulated drives, in place of the twin's version of the same table rows."""

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.rig.drives.simulated.firmware import MAX_C

from .fault_plant import World
from .injector import Injector


class DriveTorqueConstant(Injector):
    """F09: a motor gives half, double or reversed torque for the same current."""

    def draw(self) -> None:
        self.factor = float(self.generator.choice([-1.0, 0.5, 2.0]))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.turn_motor(self.joint, self.factor)


class InternalFault(Injector):
    """F12: a drive reports a fault and gives no torque."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.at_bench("fail", self.joint)


class Unplugged(Injector):
    """F12: a drive neither sends nor receives any more."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.at_bench("unplug", self.joint)


class DriveReconnection(Injector):
    """F12: a drive is lost for 50 to 300 ms and comes back."""

    def draw(self) -> None:
        self.lasts = self.ticks(int(self.generator.integers(50, 300)))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick in (self.onset, self.onset + self.lasts):
            world.at_bench("unplug" if tick == self.onset else "plug", self.joint)


class Overheated(Injector):
    """F12: a drive's winding overheats, and the drive switches off."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.at_bench("heat", self.joint, MAX_C + 10.0)

    def shows(self, told: np.ndarray, moves: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """Ticks from the next status on: the drive itself detects a hot winding only in its next step."""
        return np.arange(len(told)) > self.onset


class CableOut(Injector):
    """F13: no measurement comes from the machine, and no command reaches it."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.at_bench("cut")
            world.is_silent()


class DriveStopLineOpen(Injector):
    """F39: the line of the hardware stop opens: every drive reports it and gives no torque."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.at_bench("press")
