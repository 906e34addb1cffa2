"""Inertias that no body has: a moving link with one is refused; a link that is fixed to another becomes a ball."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from exograv.model.urdf import inertia_fault, refuse_faults

from .links import Links, mass_of

STEEL_KG_PER_M3 = 7850.0
"""Density of steel [kg/m³]."""


def impossible_inertias(robot: ElementTree.Element, where: str) -> dict[str, str]:
    """Return the fault of each link whose inertia no body has, by the name of the link."""
    faults = dict[str, str]()
    for link in robot.findall("link"):
        name, inertial = link.get("name", ""), link.find("inertial")
        fault = None if inertial is None else inertia_fault(inertial, name, where)
        if fault is not None:
            faults[name] = fault
    return faults


def take_as_ball(link: ElementTree.Element) -> None:
    """Replace the inertia of a link by that of a ball of steel with its mass and centre."""
    mass, inertia = mass_of(link), link.find("inertial/inertia")
    assert inertia is not None
    radius = (3.0 * mass / (4.0 * np.pi * STEEL_KG_PER_M3)) ** (1.0 / 3.0)
    for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
        inertia.set(key, f"{0.4 * mass * radius**2:.6g}" if key[1] == key[2] else "0")


def clean_fixed_inertias(robot: ElementTree.Element, where: str) -> list[str]:
    """Take fixed links with an impossible inertia as balls. Return a sentence if there are any.

    Args:
        robot: Root element of a URDF in which only the joints of the arm move, changed in place.
        where: Name of the file, for messages.

    Raises:
        ModelError: The inertia of a moving link is impossible; the message lists all of them.
    """
    links, faults = Links(robot), impossible_inertias(robot, where)
    joints = {name: links.joints.get(links.above.get(name, "")) for name in faults}
    moving = [name for name, joint in joints.items() if joint is not None and joint.get("type") != "fixed"]
    refuse_faults([faults[name] for name in moving])
    for name in faults:
        take_as_ball(links.links[name])
    if not faults:
        return []
    masses = ", ".join(f"{name} {mass_of(links.links[name]):.3g} kg" for name in faults)
    return [f"No body has the inertia of these fixed links, which are taken as balls of steel of their mass: {masses}."]
