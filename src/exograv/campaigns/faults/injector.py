"""How a fault enters a machine: between drives and guard, between control and guard, or in the world itself.

An injector sees what passes through the rig's own interface and may change it; what is of the world it asks for there,
be the machine the twin itself or drives on a bus.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from exograv.loop.arm_controller import ArmController
from exograv.safety.guard import ControlRequest
from exograv.signals import Command, JointState

from .fault_plant import World

TICK_S = 0.001


@dataclass
class Injector:
    """Nothing at all; each fault changes what it is about, from its onset on."""

    generator: np.random.Generator
    joints: int
    onset: int
    """Tick of the run with which it begins [-]."""

    period_ms: int = 1
    """Between two ticks."""

    ends_guard: ClassVar[bool] = False
    """Whether there is no guard from the onset on."""

    joint: int = field(init=False)
    """Which joint, where it is about one."""

    def __post_init__(self):
        self.joint = int(self.generator.integers(self.joints))
        self.draw()

    def draw(self) -> None:
        """Whatever else chance decides about it."""

    def ticks(self, ms: int) -> int:
        """So long in ticks, one at least."""
        return max(round(ms / self.period_ms), 1)

    def measured(self, state: JointState, tick: int) -> JointState:
        """What the machine says in a tick, from the onset on."""
        return state

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        """What control submits in a tick, from the onset on."""
        return submitted

    def commanded(self, command: Command, tick: int) -> Command:
        """What reaches the drives in a tick, from the onset on."""
        return command

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        """What happens in the world or to control at the beginning of a tick, from the onset on."""

    def pushes(self, tick: int) -> bool:
        """Whether it makes the person push in a tick, so that nobody can call the arm relaxed."""
        return False

    def shows(
        self, told: Float[np.ndarray, "tick joint"], noise_Nm: Float[np.ndarray, " joint"]
    ) -> Bool[np.ndarray, " tick"]:
        """Ticks in which anything can tell the fault; all from the onset on.

        Args:
            told: What each joint was told in every tick [N·m].
            noise_Nm: Of the measured currents, one standard deviation [N·m].
        """
        return np.arange(len(told)) >= self.onset

    def at_joint(self, values: np.ndarray, change: Callable[[float], float]) -> np.ndarray:
        """The same values but for that joint's."""
        changed = values.copy()
        changed[self.joint] = change(changed[self.joint])
        return changed
