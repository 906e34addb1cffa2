"""Plan of mirror therapy: the parts of a mirror guide that are made before the machine moves."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from exograv.model.assembly import Assembly
from exograv.model.description import ArmSide

from .mirror_guide import MirrorGuide
from .mirror_map import Joints, MirrorMap
from .path_shaping import allowed_range
from .pull import PullStrength

Skeleton = Callable[[Joints], tuple[list[list[float]], list[list[float]]]]
"""Function of the joint positions [rad] that returns points of machine and arms [m] (`skeleton_function`)."""


@dataclass(frozen=True)
class MirrorPlan:
    """Joints, strength and limits of a mirror guide."""

    side: ArmSide
    """Leading arm."""
    which: MirrorMap
    strength: PullStrength
    limits: tuple[Joints, Joints]
    """Lower and upper limits of the target [rad]."""
    is_first: bool
    """True if the leading arm is the first one of the machine."""

    @classmethod
    def of(cls, assembly: Assembly, side: ArmSide) -> "MirrorPlan":
        """Plan for an assembly whose arm `side` leads.

        Raises:
            ConfigError: The machine does not have two arms that are mirror images.
        """
        description, exo = assembly.description, assembly.exo
        which = MirrorMap.of(description, exo, side)
        limits = allowed_range(description, exo)
        return cls(side, which, PullStrength.of(description), limits, assembly.arm.limbs[0].side == side)

    def guide(self, q: Joints, dt: float, skeleton: Skeleton) -> MirrorGuide:
        """Return a guide for arms at `q` [rad]."""
        to_middle = partial(hand_to_middle, skeleton, self.is_first)
        return MirrorGuide(self.which, self.strength, self.limits, q, dt, self.side, to_middle)


def hand_to_middle(skeleton: Skeleton, is_first: bool, q: Joints) -> float:
    """Distance from the leading fingertip or wrist, the nearer one, to the plane between the shoulders [m].

    The distance is negative beyond the plane.
    """
    # The skeleton runs from the first arm's fingertip over both shoulders to the other fingertip.
    points = np.array(skeleton(q)[1])
    if not is_first:
        points = points[::-1]
    half = len(points) // 2
    own, other = points[half - 1], points[half]
    across = (own - other) / np.linalg.norm(own - other)
    return float(((points[:2] - 0.5 * (own + other)) @ across).min())
