"""Links of a human arm in the machine's file, by name and mass."""

import re
import xml.etree.ElementTree as ElementTree

from exograv.errors import ConfigError

from .links import Links, mass_of, parent_of

PERSON = re.compile(
    r"human|wearer|operator|patient|subject(?!ive)|person|mannequin|manikin|phantom|dummy", re.IGNORECASE
)
ANATOMY = re.compile(r"humerus|ulna|radius|clavicle|forearm|upper_?arm|lower_?arm|(^|_)(hand|arm)(_|$)", re.IGNORECASE)
BONES = re.compile(r"humerus|ulna|radius|clavicle|scapula", re.IGNORECASE)
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
        _leave_out(links.links[name])
    return [f"Left out as the wearer's, as answered: {masses}."]


def _is_person(links: Links, name: str) -> bool:
    """Return True if a link is named like a person or a bone, or like a limb fixed to a link with a mass of its own."""
    if PERSON.search(name):
        return True
    if BONES.search(name) and not MACHINE.search(name) and mass_of(links.links[name]) >= LIGHTEST_KG:
        return True  # In a file of a person in the machine, the machine's joint moves the bone.
    joint = links.above.get(name)
    if joint is None or not ANATOMY.search(name) or MACHINE.search(name) or links.joints[joint].get("type") != "fixed":
        return False
    if any(links.joints[links.above[one]].get("type") != "fixed" for one in links.subtree(name)[1:]):
        return False  # A hand that carries driven fingers is the machine's.
    carrier = links.links[parent_of(links.joints[joint])]
    return mass_of(links.links[name]) >= LIGHTEST_KG and mass_of(carrier) > 0.0


def _leave_out(element: ElementTree.Element) -> None:
    """Remove the mass of a link. Its place stays, since it shows where the limb lies."""
    inertial = element.find("inertial")
    if inertial is not None:
        element.remove(inertial)
