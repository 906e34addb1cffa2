"""Assembly of exoskeleton and arm: two trees and the cuffs between them."""

from collections.abc import Mapping
from dataclasses import dataclass

from exograv.errors import ModelError

from .arm import Arm
from .description import Cuff, RigDescription
from .tree import Tree
from .urdf import root_of, tree_of


@dataclass(frozen=True)
class Assembly:
    """Machine that is adjusted to the wearer's measured lengths, with the arm of the table."""

    description: RigDescription
    exo: Tree
    arm: Arm
    cuffs: tuple[Cuff, ...]
    slid_m: tuple[float, ...] = ()
    """Way of each cuff along the limb since it was fastened [m]; empty if no cuff has moved."""

    @property
    def n(self) -> int:
        """Number of the machine's joints."""
        return len(self.exo.joints)

    @property
    def n_freedoms(self) -> int:
        """Number of freedoms of the arm, or of both arms together."""
        return len(self.arm.freedoms)


def read_exoskeleton(description: RigDescription) -> Tree:
    """Read the machine's tree, with joints in the order of `description.joints`.

    Raises:
        ModelError: URDF and `rig.toml` do not agree, or the URDF cannot be used.
    """
    path = description.urdf_path
    tree = tree_of(root_of(description.urdf_text(), path.name), path)
    if tree.joint_names != description.joints:
        raise ModelError(
            f"{description.urdf_path.name} moves at {', '.join(tree.joint_names)}; rig.toml has actuators for "
            f"{', '.join(description.joints)}. Give every moving joint one actuator, in the URDF's order."
        )
    settings = description.settings
    centres = [description.shoulder_centre(side) for side in description.arm_sides]
    for name in [*centres, *description.mounts, *(c.exo_frame for c in settings.cuffs)]:
        tree.frame(name)
    for adjustment in settings.adjustments:
        tree.index(adjustment.joint)
    return tree


def adjusted(tree: Tree, description: RigDescription, lengths: Mapping[str, float]) -> Tree:
    """Set the machine to the wearer's measured lengths [m].

    Raises:
        ModelError: A length is outside the machine's range of adjustment.
    """
    for adjustment in description.settings.adjustments:
        length = lengths[adjustment.segment]
        if not adjustment.min_m <= length <= adjustment.max_m:
            raise ModelError(
                f"{description.name} takes {adjustment.segment} lengths of {adjustment.min_m} to {adjustment.max_m} m; "
                f"this wearer's is {length:.3f} m. Measure it again or use another machine."
            )
        tree = tree.with_distance(adjustment.joint, adjustment.axis, length)
    return tree
