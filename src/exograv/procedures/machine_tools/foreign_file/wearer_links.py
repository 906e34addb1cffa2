"""Links of a human arm in the machine's file, by name and mass."""

import re
import xml.etree.ElementTree as ElementTree

from exograv.errors import ConfigError

from .links import Links, child_of, mass_of, parent_of

PERSON = re.compile(
    r"human|wearer|operator|patient|subject(?!ive)|person|mannequin|manikin|phantom|dummy", re.IGNORECASE
)
ANATOMY = re.compile(r"humerus|ulna|radius|clavicle|forearm|upper_?arm|lower_?arm|(^|_)(hand|arm)(_|$)", re.IGNORECASE)
MACHINE = re.compile(r"exo|orthosis|cuff|shell|brace|mount|frame|bracket|robot|motor|drive|link|base", re.IGNORECASE)
LIGHTEST_KG = 0.25
"""Hand of a woman of 45 kg; a lighter link with an anatomical name is a bracket or a cuff."""


def examine_wearer_links(robot: ElementTree.Element, answer: str | None) -> list[str]:
    """Leave out the links of a human arm if the answer is "leave-out". Return a sentence for each change.

    Raises:
        ConfigError: There are such links and no answer.
    """
    links = Links(robot)
    found = [name for name in links.links if _is_person(links, name)]
    if not found:
        return []
    masses = ", ".join(f"{name} {mass_of(links.links[name]):.4g} kg" for name in found)
    total = sum(mass_of(links.links[name]) for name in found)
    if answer is None:
        raise ConfigError(
            f"These links look like a human arm in the machine's file, {total:.4g} kg together: {masses}. Are they the "
            "wearer's? exograv adds the wearer itself. Repeat with --wearer-links leave-out if they are, or with "
            "--wearer-links keep if they are parts of the machine."
        )
    if answer == "keep":
        return [f"Parts of the machine, as answered: {masses}."]
    for name in found:
        _leave_out(robot, Links(robot), name)
    return [f"Left out as the wearer's, as answered: {masses}."]


def _is_person(links: Links, name: str) -> bool:
    """Return True if a link is named like a person, or like a limb that is fixed to a link with a mass of its own."""
    if PERSON.search(name):
        return True
    joint = links.above.get(name)
    if joint is None or not ANATOMY.search(name) or MACHINE.search(name) or links.joints[joint].get("type") != "fixed":
        return False
    if any(links.joints[links.above[one]].get("type") != "fixed" for one in links.subtree(name)[1:]):
        return False  # A hand that carries driven fingers is the machine's.
    carrier = links.links[parent_of(links.joints[joint])]
    return mass_of(links.links[name]) >= LIGHTEST_KG and mass_of(carrier) > 0.0


def _leave_out(robot: ElementTree.Element, links: Links, name: str) -> None:
    """Remove a link; a link that carries others keeps its place without its mass."""
    if name not in links.links:
        return
    element = links.links[name]
    others = [child_of(links.joints[joint]) for joint in links.below(name)]
    if not others and name in links.above:
        robot.remove(links.joints[links.above[name]])
        robot.remove(element)
        return
    inertial = element.find("inertial")
    if inertial is not None:
        element.remove(inertial)
