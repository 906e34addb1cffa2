"""Interface of fault injectors: between drives and guard, between control and guard, or in the world itself.

An injector sees the data at the rig's own interface and may change it. Changes of the world are requested through
`World`, which is the twin itself or a set of drives on a bus.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from exograv.loop.arm_controller import ArmController
from exograv.safety.guard import ControlRequest
from exograv.signals import Command, JointState

from .fault_plant import FaultParticipant, World
from .scenario_log import ScenarioLog

TICK_S = 0.001


@dataclass
class Injector:
    """Injector without effect. Each fault overrides the methods that it needs; they act from the onset on."""

    generator: np.random.Generator
    joints: int
    onset: int
    """First tick of the fault [-]."""

    period_ms: int = 1
    """Time between two ticks [ms]."""

    ends_guard: ClassVar[bool] = False
    """True if there is no guard from the onset on."""

    begins_at_once: ClassVar[bool] = False
    """True if the fault is there from the first tick on, in place of a drawn onset."""

    joint: int = field(init=False)
    """Index of the faulty joint, for faults of one joint."""

    unbalanced: float = field(init=False, default=0.0)
    """Largest share of the arm's weight that the fault leaves without support, or adds to it [-]."""

    @property
    def changes_signals(self) -> bool:
        """True if the fault changes what is measured, answered, or commanded, and not only the world or control."""
        return any(
            getattr(type(self), name) is not getattr(Injector, name) for name in ("measured", "answered", "commanded")
        )

    def __post_init__(self):
        self.joint = int(self.generator.integers(self.joints))
        self.draw()

    def draw(self) -> None:
        """Draw the fault's further random values."""

    def known(self, participant: FaultParticipant) -> FaultParticipant:
        """Return the participant as the software knows them in this flight."""
        return participant

    def begin(self, world: World) -> None:
        """Prepare the world before the first tick."""

    def ticks(self, ms: int) -> int:
        """Convert a duration to ticks, at least one."""
        return max(round(ms / self.period_ms), 1)

    def measured(self, state: JointState, tick: int) -> JointState:
        """Return the measurement of a tick with the fault, from the onset on."""
        return state

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        """Return control's answer in a tick with the fault, from the onset on."""
        return submitted

    def commanded(self, command: Command, tick: int) -> Command:
        """Return the command that reaches the drives in a tick, from the onset on."""
        return command

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        """Change the world or control at the beginning of a tick, from the onset on."""

    def report(self, course: ScenarioLog) -> None:
        """Note figures that only the injector measures, after the flight."""

    def pushes(self, tick: int) -> bool:
        """Return True if the fault makes the person push in a tick, so that the arm does not count as relaxed."""
        return False

    def shows(
        self,
        told: Float[np.ndarray, "tick joint"],
        moves: Bool[np.ndarray, "tick joint"],
        noise_Nm: Float[np.ndarray, " joint"],
    ) -> Bool[np.ndarray, " tick"]:
        """Return the ticks in which the fault is detectable at all; all ticks from the onset on.

        Args:
            told: Commanded torque of each joint in every tick [N·m].
            moves: Joints that clearly move in each tick.
            noise_Nm: Standard deviation of the measured currents, as torque [N·m].
        """
        return np.arange(len(told)) >= self.onset

    def at_joint(self, values: np.ndarray, change: Callable[[float], float]) -> np.ndarray:
        """Return the values with that of the faulty joint changed."""
        changed = values.copy()
        changed[self.joint] = change(changed[self.joint])
        return changed
