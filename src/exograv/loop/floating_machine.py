"""Machine in which an identified arm floats, as a procedure sees it: the same in lock-step and live."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from exograv import motion
from exograv.errors import RigError

from .arm_controller import ArmController
from .pilot import Pilot
from .tick_sample import TickSample

Joints = np.ndarray
Look = Callable[[float, Joints], bool]
"""Function of the time [s] and the joint positions [rad] that returns True to end a run."""

LOOK_S = 0.02
"""Time between two looks of a procedure at the machine [s]."""

REFUSED = "The guard refused a change of the support. The recording shows the reason."


@runtime_checkable
class FloatingMachine(Protocol):
    """Machine that carries an identified arm. Its guard has the limits of the person."""

    @property
    def t(self) -> float:
        """Time on the machine's clock [s]."""
        ...

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        ...

    @property
    def gravity_level(self) -> float:
        """Share of the arm's weight that the person feels now [-]."""
        ...

    def begin(self, phase: str) -> None:
        """Note in the recording the phase that begins."""
        ...

    def feel(self, gravity_level: float) -> None:
        """Lead the gravity level that the person feels to this value, by the ramp of the guard.

        Raises:
            RigError: The guard refuses it.
        """
        ...

    def float_for(self, seconds: float, look: Look) -> None:
        """Let the arm float for a time [s], or until `look` returns True. It is called every `LOOK_S`.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arm in the base frame [m], by the controller's model."""
        ...

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Write a message of the time `t` [s] into the recording, if there is one."""
        ...


class PilotedMachine:
    """Machine of a pilot, in lock-step or in real time in this process."""

    def __init__(self, pilot: Pilot, controller: ArmController, each_tick: Callable[[], object] = lambda: None):
        """Take a machine that carries the arm already.

        Args:
            pilot: Pilot of the worn machine.
            controller: Controller of the arm.
            each_tick: Function that is called in each tick, such as the muscles of a simulated person.

        Raises:
            RigError: The guard has no limits of a person.
        """
        self._pilot, self._controller, self._each_tick = pilot, controller, each_tick
        self._look_ticks, self._ticks = max(round(LOOK_S / pilot.rig.period_s), 1), 0
        if pilot.envelope.person is None:
            raise RigError(
                "The guard does not know who is in the machine. Give it the person's limits before the support changes."
            )

    @property
    def t(self) -> float:
        """Time on the machine's clock [s]."""
        return self._pilot.rig.t

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        return self._pilot.q

    @property
    def gravity_level(self) -> float:
        """Share of the arm's weight that the person feels now [-]."""
        person = self._pilot.envelope.person
        return 0.0 if person is None else person.gravity_level

    @property
    def clipped_share(self) -> float:
        """Share of the ticks in which the guard limited torque or its rate [-]."""
        return self._pilot.envelope.clipped_ticks / max(self._ticks, 1)

    def begin(self, phase: str) -> None:
        """Note in the recording the phase that begins."""
        self._pilot.begin(phase)

    def feel(self, gravity_level: float) -> None:
        """Lead the gravity level that the person feels to this value, by the ramp of the guard.

        Raises:
            RigError: The guard refuses it.
        """
        if not self._pilot.guard.feel(gravity_level):
            raise RigError(REFUSED)

    def float_for(self, seconds: float, look: Look) -> None:
        """Let the arm float for a time [s], or until `look` returns True.

        Raises:
            RigError: The envelope stopped the run.
        """
        dt, ended = self._pilot.rig.period_s, False

        def act(moment: TickSample) -> None:
            nonlocal ended
            self._each_tick()
            self._controller.mode.gravity_level = self.gravity_level
            self._ticks += 1
            if self._ticks % self._look_ticks == 0:
                ended = look(moment.state.t, moment.q)

        # The pilot needs a reference, but no feedback drives the machine to it here.
        slice_s = self._look_ticks * dt
        for _ in range(round(seconds / slice_s)):
            self._pilot.run(self._controller, motion.hold(self._pilot.q.copy(), slice_s, dt), "", act)
            if ended:
                break

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arm in the base frame [m], by the controller's model."""
        return self._controller.skeleton(q)

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Write a message of the time `t` [s] into the recording, if there is one."""
        if self._pilot.recording is not None:
            self._pilot.recording.write(topic, t, message)
