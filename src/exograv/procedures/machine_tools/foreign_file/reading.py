"""Reading of a machine's file of any kind: URDF, MJCF by a given converter, and xacro with its next step."""

import copy
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

from exograv.errors import ModelError
from exograv.model.completed_urdf import completed_urdf
from exograv.model.urdf import element_faults, refuse_faults, root_of, text_of

from .inertias import impossible_inertias, take_as_ball
from .limits import drop_empty_limits, missing_limits, placeholders
from .links import mass_of

MACRO = re.compile(r"<xacro:|\$\{|\$\(")
Converter = Callable[[Path], str]
"""Function from the path of an MJCF file to the text of a URDF."""


def read_foreign(path: Path, convert: Converter | None) -> ElementTree.Element:
    """Return the root element of a URDF without faults in its links and joints; missing limits are none.

    Inertias that no body has may be left: links that are fixed later do not need one.

    Raises:
        ModelError: The file cannot be used; the message lists all faults.
    """
    text = text_of(path)
    if MACRO.search(text) and "<robot" in text:
        plain = path.name.removesuffix(".xacro")
        plain = plain if plain.endswith(".urdf") and plain != path.name else f"{path.stem}_expanded.urdf"
        raise ModelError(
            f"{path.name} is a xacro file that is not expanded. Expand it first: xacro {path.name} > {plain}"
        )
    if "<mujoco" in text and "<robot" not in text:
        if convert is None:
            raise ModelError(f"{path.name} is an MJCF file. Give it to the command `exograv rig new`.")
        text = convert(path)
    robot = root_of(text, path.name)
    drop_pictures(robot)
    drop_empty_limits(robot)
    refuse_faults(_faults(robot, path.name))
    return robot


def drop_pictures(robot: ElementTree.Element) -> None:
    """Remove shapes, which are only for pictures and need meshes, empty inertials, and what URDF does not define."""
    for link in robot.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
        inertial = link.find("inertial")
        if inertial is not None and inertial.find("mass") is not None and _is_massless(link):
            link.remove(inertial)
    for element in list(robot):
        if element.tag not in ("link", "joint"):
            robot.remove(element)


def _is_massless(link: ElementTree.Element) -> bool:
    try:
        return mass_of(link) == 0.0
    except ValueError:
        return False


def _faults(robot: ElementTree.Element, where: str) -> list[str]:
    """Return all faults of links and joints that fixing a joint or asking for its limit does not solve.

    Inertias that no body has are among them only if there are other faults.
    """
    trial, impossible = copy.deepcopy(robot), impossible_inertias(robot, where)
    for link in trial.findall("link"):
        if link.get("name", "") in impossible:
            take_as_ball(link)
    for joint in trial.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        if joint.get("type") in ("floating", "planar"):
            joint.set("type", "fixed")
    text = completed_urdf(ElementTree.tostring(trial, encoding="unicode"), placeholders(missing_limits(trial)))
    faults = element_faults(ElementTree.fromstring(text), where)
    return [*faults, *impossible.values()] if faults else []
