"""Floating arm of one person that a guide leads, as a procedure sees it: the same in lock-step and live."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from exograv.loop.phases import Phase
from exograv.loop.tick_sample import Joints, ObservedMotion
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription

from .mirror_guide import MirrorGuide
from .path_guide import Anchor, PathGuide

LedBy = Anchor | PathGuide | MirrorGuide
Listener = Callable[[ObservedMotion], None]


@runtime_checkable
class GuidedArm(Protocol):
    """Arm that floats, or that a guide leads."""

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        ...

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        ...

    @property
    def description(self) -> RigDescription:
        """Description of the machine."""
        ...

    def begin(self, phase: Phase | str) -> None:
        """Note in the recording the phase that begins."""
        ...

    def lead(self, guide: LedBy, listener: Listener) -> None:
        """Fade from floating to guided: the control law's feedback comes by a ramp, and with it the guide's pull.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def float_again(self, guide: LedBy, listener: Listener) -> None:
        """Fade from guided to floating.

        Raises:
            RigError: The machine was stopped.
        """
        ...

    def run(
        self,
        seconds: float,
        text: str,
        listener: Listener,
        guide: LedBy | None = None,
        done: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Run for `seconds`, or until `done` is true. Return True if it was.

        Raises:
            RigError: The machine was stopped.
        """
        ...


@runtime_checkable
class GuidedArms(GuidedArm, Protocol):
    """Both arms of a person, of which a `MirrorGuide` lets one lead and guides the other one."""

    @property
    def assembly(self) -> Assembly:
        """The machine with the arms in it."""
        ...

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arms in the base frame [m], by the controller's model."""
        ...
