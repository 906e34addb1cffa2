"""Machine that holds and moves an identified arm, as a procedure sees it: the same in lock-step and live."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from exograv import motion
from exograv.dynamics.parameters import Parameters
from exograv.model.arm import WeightPlace, summed_weights
from exograv.motion import Planned

from .arm_controller import ArmController
from .mode_ramp import fade
from .phases import FLOATING, Drive, Phase
from .pilot import Pilot
from .tick_sample import TickSample

Joints = np.ndarray
Heard = Callable[[Joints, Joints], object]
"""Function that takes the measured positions [rad] and torques [N·m] of a tick."""


@runtime_checkable
class MovedMachine(Protocol):
    """Machine that carries an identified arm, holds it and moves it along paths."""

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        ...

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        ...

    @property
    def weights(self) -> Mapping[WeightPlace, float]:
        """Weights that are carried in addition to the arm [kg]."""
        ...

    def lead(self) -> None:
        """Hold the weightless arm where it is. The feedback comes by a ramp.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def let_float(self) -> None:
        """Let the arm float again. The feedback goes by a ramp.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def hold(self, seconds: float, text: str) -> None:
        """Hold the arm for a time [s].

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def follow(self, path: Planned, text: str, heard: Heard | None = None) -> None:
        """Move the arm along a path, and give each tick to `heard`.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def expect_weight(self, x: Parameters, place: WeightPlace, v_motion: float) -> None:
        """Prepare the guard for an unknown weight at `place`, with an arm `x` that moves at up to `v_motion` [rad/s].

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def know(self, x: Parameters) -> None:
        """Give the guard the limits of an arm `x` with the weights that are carried.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def carry(self, place: WeightPlace, mass: float) -> None:
        """Carry a weight [kg] at this place from now on; zero removes it.

        Raises:
            RigError: The machine was stopped.
        """
        ...


def approach(machine: MovedMachine, phase: Phase, posture: Joints, text: str) -> None:
    """Move the arm to the first posture of a phase [rad], and wait there until it is calm."""
    machine.follow(phase.passage(machine.q, posture, machine.period_s), text)


class PilotedArm:
    """`MovedMachine` of a pilot, in lock-step or in real time in this process."""

    def __init__(self, pilot: Pilot, controller: ArmController):
        """Take a machine that carries the arm already."""
        self._pilot, self._controller, self._held = pilot, controller, pilot.q.copy()

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        return self._pilot.q

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        return self._pilot.rig.period_s

    @property
    def weights(self) -> Mapping[WeightPlace, float]:
        """Weights that are carried in addition to the arm [kg]."""
        return self._controller.weights

    def lead(self) -> None:
        """Hold the weightless arm where it is. The feedback comes by a ramp."""
        fade(self._pilot, self._controller, "drive", Drive.ALWAYS.goal(is_known=True), self.q.copy())
        fade(self._pilot, self._controller, "gravity_level", 0.0, self.q.copy())
        self._held = self.q.copy()

    def let_float(self) -> None:
        """Let the arm float again. The feedback goes by a ramp."""
        fade(self._pilot, self._controller, "drive", FLOATING.drive.goal(is_known=True), self.q.copy())

    def hold(self, seconds: float, text: str) -> None:
        """Hold the arm for a time [s]."""
        self._pilot.run(self._controller, motion.hold(self._held, seconds, self.period_s), text)

    def follow(self, path: Planned, text: str, heard: Heard | None = None) -> None:
        """Move the arm along a path, and give each tick to `heard`."""

        def listen(moment: TickSample) -> None:
            if heard is not None:
                heard(moment.state.q, moment.tau_measured)

        table = path.table()
        self._pilot.run(self._controller, table, text, None if heard is None else listen)
        self._held = table.q[-1].copy()

    def expect_weight(self, x: Parameters, place: WeightPlace, v_motion: float) -> None:
        """Prepare the guard for an unknown weight at `place`. A machine that nobody wears has no such limits."""
        if self._pilot.worn is not None:
            self._pilot.worn.weigh(x, place, v_motion)

    def know(self, x: Parameters) -> None:
        """Give the guard the limits of an arm `x` with the weights that are carried."""
        if self._pilot.worn is not None:
            self._pilot.worn.know(x, summed_weights(self._controller.assembly.arm, self.weights))

    def carry(self, place: WeightPlace, mass: float) -> None:
        """Carry a weight [kg] at this place from now on; zero removes it."""
        self._controller.carry(place, mass, self._pilot.q)
