"""Identified arm that floats behind the guard with all its weight carried: the start of teach, repeat and mirror."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from exograv import motion
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.output_feedback import Guide
from exograv.loop.phases import FLOATING, Drive, Phase
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import Joints, TickSample
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.rig import Rig
from exograv.safety.stops import StopReason

from .mirror_guide import MirrorGuide

LOOK_S = 0.02
"""Time between two checks whether a run is done [s]."""


AnyRig = TypeVar("AnyRig", bound=Rig)


@dataclass(frozen=True)
class GuardRecord:
    """Actions of the guard in one run."""

    stop: StopReason | None
    limited_ticks: int
    ticks: int


@dataclass
class FloatingArm(Generic[AnyRig]):
    """Machine with the arm of a person, its pilot, and the controller that carries machine and arm."""

    rig: AnyRig
    pilot: Pilot
    controller: ArmController

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        return self.pilot.q

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        return self.pilot.rig.period_s

    @property
    def description(self) -> RigDescription:
        """Description of the machine."""
        return self.controller.assembly.description

    @property
    def assembly(self) -> Assembly:
        """The machine with the arm in it."""
        return self.controller.assembly

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arm in the base frame [m], by the controller's model."""
        return self.controller.skeleton(q)

    def begin(self, phase: Phase | str) -> None:
        """Note in the recording the phase that begins."""
        self.pilot.begin(phase)

    def lead(self, guide: Guide, listener: Callable[[TickSample], None]) -> None:
        """Fade from floating to guided: the control law's feedback comes by a ramp, and with it the guide's pull."""
        if isinstance(guide, MirrorGuide):
            self.controller.let_lead(guide.side)
        fade(
            self.pilot, self.controller, "drive", Drive.ALWAYS.goal(is_known=True), self.pilot.q.copy(), guide, listener
        )

    def float_again(self, guide: Guide, listener: Callable[[TickSample], None]) -> None:
        """Fade from guided to floating."""
        fade(
            self.pilot,
            self.controller,
            "drive",
            FLOATING.drive.goal(is_known=True),
            self.pilot.q.copy(),
            guide,
            listener,
        )
        if isinstance(guide, MirrorGuide):
            self.controller.let_lead(None)

    def run(
        self,
        seconds: float,
        text: str,
        listener: Callable[[TickSample], None],
        guide: Guide | None = None,
        done: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Run for `seconds`, or until `done` is true. Return True if it was.

        Raises:
            RigError: The envelope stopped the run.
        """
        slice_s = LOOK_S
        for _ in range(round(seconds / slice_s)):
            held = motion.hold(self.pilot.q.copy(), slice_s, self.pilot.rig.period_s)
            self.pilot.run(self.controller, held, text, listener, guide)
            if done():
                return True
        return False

    @property
    def guard_record(self) -> GuardRecord:
        """Actions of the guard, for figures."""
        envelope = self.pilot.envelope
        return GuardRecord(envelope.stop, envelope.clipped_ticks, self.pilot.tick_us.total())


def rms_deg(errors: list[np.ndarray]) -> list[float]:
    """RMS of each joint [°], from errors of each tick [rad]."""
    if not errors:
        return []
    return np.rad2deg(np.sqrt(np.mean(np.square(errors), axis=0))).round(3).tolist()
