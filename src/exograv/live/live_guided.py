"""Arm, or arms, of a live run that a guide leads: control runs the guide, and this process has a copy of its state."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from exograv.loop.floating_machine import LOOK_S
from exograv.loop.phases import Phase
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.motion import Passage, Trajectory
from exograv.procedures.rehabilitation.guided.grip import GripOutcome
from exograv.procedures.rehabilitation.guided.guided_arm import LedBy, Listener
from exograv.procedures.rehabilitation.guided.mirror_guide import MirrorGuide
from exograv.procedures.rehabilitation.guided.path_guide import Anchor, PathGuide

from .live_moved import LiveMoved
from .procedure_orders import STATES

Joints = np.ndarray


class SeenMotion(NamedTuple):
    """Motion that control has observed in a tick."""

    q: Joints
    """Observed position [rad]."""
    v: Joints
    """Observed velocity [rad/s]."""


class LiveGuided:
    """`GuidedArm` or `GuidedArms` of a live run. However the procedure ends, the guard lets the arm down."""

    def __init__(self, machine: LiveMoved):
        """Take a machine in which the identified arm floats."""
        self._machine, self._floating = machine, machine.floating
        self._guide: LedBy | None = None
        self._number, self._is_told_to_let_go = 0, False

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        return self._floating.q

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        return self._machine.period_s

    @property
    def description(self) -> RigDescription:
        """Description of the machine."""
        return self.assembly.description

    @property
    def assembly(self) -> Assembly:
        """The machine with the arm in it."""
        return self._machine.model.assembly

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arm in the base frame [m], by the controller's model."""
        return self._floating.skeleton(q)

    def begin(self, phase: Phase | str) -> None:
        """Note in the recording the part of the procedure that begins."""
        self._floating.begin(phase if isinstance(phase, str) else phase.recorded)

    def lead(self, guide: LedBy, listener: Listener) -> None:
        """Fade from floating to guided: the control law's feedback comes by a ramp, and with it the guide's pull."""
        self._machine.allow_motion()
        self._put_in_charge(guide)
        while self._floating.drive < 1.0:
            self._hear(guide, listener)

    def float_again(self, guide: LedBy, listener: Listener) -> None:
        """Fade from guided to floating."""
        self._machine.let_float()
        self._guide = None

    def run(
        self,
        seconds: float,
        text: str,
        listener: Listener,
        guide: LedBy | None = None,
        done: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Run for `seconds`, or until `done` is true. Return True if it was."""
        if guide is not None and guide is not self._guide:
            self._put_in_charge(guide)
        begun = looked = self._floating.t
        while (now := self._floating.t) < begun + seconds:
            if guide is None:
                self._floating.wait()
                listener(SeenMotion(self.q, self._floating.v))
            else:
                self._hear(guide, listener)
            if done():
                return True
            if now - looked >= LOOK_S:
                looked = now
                self._machine.progress(text, (now - begun) / seconds)
        return False

    def _put_in_charge(self, guide: LedBy) -> None:
        self._guide, self._is_told_to_let_go = guide, False
        if isinstance(guide, Anchor):
            there = Passage(guide.target, guide.target, 1, 0, self.period_s)
            self._number = self._machine.order(is_led=True, guide="anchor", path=there)
        elif isinstance(guide, MirrorGuide):
            self._number = self._machine.order(is_led=True, guide="mirror")
        elif isinstance(guide.path, Trajectory):
            self._number = self._machine.order(is_led=True, guide="taught", speed=guide.speed, grip=guide.grip)
        else:
            self._number = self._machine.order(
                is_led=True, guide="path", path=guide.path, speed=guide.speed, grip=guide.grip
            )

    def _hear(self, guide: LedBy, listener: Listener) -> None:
        """Take the ticks that have arrived, and pass a release on to control."""
        self._floating.wait()
        for row in self._machine.new_rows():
            if row["order"] < self._number:
                continue
            guide.grip, guide.target = float(row["grip"]), row["target"].copy()
            if isinstance(guide, PathGuide | MirrorGuide):
                guide.waited_s, guide.tau = float(row["waited_s"]), row["pull"].copy()
                # Control does not know of a release yet that has just been decided here.
                if guide.state is not GripOutcome.RELEASED:
                    guide.state = STATES[int(row["state"])]
            listener(SeenMotion(row["q_observed"].copy(), row["v"].copy()))
        releases = guide.lets_go if isinstance(guide, Anchor) else guide.state is GripOutcome.RELEASED
        if releases and not self._is_told_to_let_go:
            self._is_told_to_let_go = True
            self._number = self._machine.order(is_led=True, lets_go=True)
