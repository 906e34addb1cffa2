"""Machine file of a stranger: the joints of its arm, and everything else fixed or left out with a reason."""

import xml.etree.ElementTree as ElementTree

from exograv.errors import ConfigError
from exograv.options import Side

from .arm_joints import ArmJoints, arm_joints, refuse_unnamed_arms
from .fixing import keep_joints
from .links import Links
from .wearer_links import examine_wearer_links, heavy_links, heavy_links_note


def prepare(
    robot: ElementTree.Element, side: Side | None, wearer_links: str | None, joints: tuple[str, ...]
) -> list[str]:
    """Leave only the joints of the machine's arm movable in `robot`. Return a sentence for each change.

    Args:
        robot: Root element of a URDF without faults, changed in place.
        side: Arm to keep; both if None.
        wearer_links: Answer to the question for links of a human arm: "leave-out", "keep", names of links, or None.
        joints: Joints that move the arm, in place of the inferred ones.

    Raises:
        ConfigError: Links look like a human arm and nothing says what they are, no joint is left, or the sides of two
            arms are not told.
    """
    notes = examine_wearer_links(robot, wearer_links)
    links = Links(robot)
    if unknown := [name for name in joints if name not in links.joints]:
        raise ConfigError(f"--joints names {', '.join(unknown)}; joints of the file: {', '.join(links.joints)}.")
    found = ArmJoints(tuple(joints), {}) if joints else arm_joints(links, side)
    if not found.kept:
        reasons = "; ".join(f"{name}: {why}" for name, why in found.fixed.items())
        raise ConfigError(
            f"No joint of the file moves an arm of the {side or 'machine'} ({reasons}). Name its joints with --joints."
        )
    refuse_unnamed_arms(links, found.kept)
    heavy = heavy_links(links) if wearer_links in (None, "leave-out") else []
    notes += keep_joints(robot, links, found)
    return notes + heavy_links_note(robot, heavy)
