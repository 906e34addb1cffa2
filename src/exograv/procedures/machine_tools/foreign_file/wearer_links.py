"""Links of a human arm in the machine's file, by name and mass; without a telling name they are only pointed out."""

import re
import xml.etree.ElementTree as ElementTree

from exograv.errors import ConfigError

from .links import Links, child_of, mass_of, parent_of

PERSON = re.compile(
    r"human|wearer|operator|patient|subject(?!ive)|person|mannequin|manikin|phantom|dummy", re.IGNORECASE
)
ANATOMY = re.compile(r"humerus|ulna|radius|clavicle|forearm|upper_?arm|lower_?arm|(^|_)(hand|arm)(_|$)", re.IGNORECASE)
BONES = re.compile(r"humerus|ulna|radius|clavicle|scapula", re.IGNORECASE)
MACHINE = re.compile(r"exo|orthosis|cuff|shell|brace|mount|frame|bracket|robot|motor|drive|link|base", re.IGNORECASE)
LIGHTEST_KG = 0.25
"""Hand of a woman of 45 kg; a lighter link with an anatomical name is a bracket or a cuff."""

PART = re.compile(
    r"motor|drive|actuator|gear|stator|rotor|housing|case|cover|cuff|shell|brace|mount|bracket|plate|frame|spring"
    r"|battery|electronic|encoder|sensor|counter|weight|ballast",
    re.IGNORECASE,
)
"""Names of parts of a machine that may be heavier than the link that carries them."""
FOREARM_KG = 0.62
"""Forearm of a woman of 45 kg, 1.38 % of her mass (de Leva 1996): the lightest segment that is pointed out."""


def examine_wearer_links(robot: ElementTree.Element, answer: str | None) -> list[str]:
    """Leave out the links of a human arm, as answered. Return a sentence for each change.

    Args:
        robot: Root element of a URDF without faults, changed in place.
        answer: "leave-out" or "keep" for the links that are named like a person, or the names of the wearer's links,
            separated by commas; None if there is no answer.

    Raises:
        ConfigError: There are such links and no answer, or the answer names a link that is not in the file.
    """
    links = Links(robot)
    named = [] if answer is None or answer in ("leave-out", "keep") else answer.split(",")
    if unknown := [name for name in named if name not in links.links]:
        raise ConfigError(
            f"--wearer-links names {', '.join(unknown)}; allowed: leave-out, keep, or links of the file: "
            f"{', '.join(links.links)}."
        )
    found = named or [name for name in links.links if _is_person(links, name)]
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


def heavy_links(links: Links) -> list[str]:
    """Return the links without a telling name that weigh like a segment of an arm and are fixed to a lighter link.

    Links with a mass that are fixed to such a link, as a hand to a forearm, are among them.
    """
    behind = {one for name in links.links if _is_heavy(links, name) for one in links.subtree(name)}
    return [name for name in links.links if name in behind and mass_of(links.links[name]) > 0.0]


def heavy_links_note(robot: ElementTree.Element, heavy: list[str]) -> list[str]:
    """Return a sentence that asks whether heavy links are the wearer's; none if no joint of the machine moves them."""
    links = Links(robot)
    moved = [name for name in heavy if name in links.above and _is_moved(links, name)]
    if not moved:
        return []
    masses = ", ".join(f"{name} {mass_of(links.links[name]):.4g} kg" for name in moved)
    return [
        f"Heavier than the link that carries it, and like a segment of a person: {masses}. If the wearer was drawn "
        f"into the file, repeat with --wearer-links {','.join(moved)}: exograv adds the wearer itself."
    ]


def _is_heavy(links: Links, name: str) -> bool:
    """Return True if a fixed link that moves nothing else is heavier than its carrier and than the lightest forearm."""
    mass = mass_of(links.links[name])
    if mass < FOREARM_KG or PART.search(name) or not _is_fixed(links, name):
        return False
    if not all(_is_fixed(links, one) for one in links.subtree(name)[1:]):
        return False
    carrier = parent_of(links.joints[links.above[name]])
    while mass_of(links.links[carrier]) == 0.0 and _is_fixed(links, carrier):
        carrier = parent_of(links.joints[links.above[carrier]])
    return 0.0 < mass_of(links.links[carrier]) < mass


def _is_fixed(links: Links, name: str) -> bool:
    return name in links.above and links.joints[links.above[name]].get("type") == "fixed"


def _is_moved(links: Links, name: str) -> bool:
    return any(not _is_fixed(links, child_of(links.joints[one])) for one in links.chain(links.above[name]))


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
