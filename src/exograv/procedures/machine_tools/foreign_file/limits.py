"""Joint limits that a URDF does not give, or gives as zero, as exporters of CAD programs do."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

from exograv.model.completed_urdf import PLACEHOLDER

PAIR = ("lower", "upper")


def drop_empty_limits(robot: ElementTree.Element) -> None:
    """Remove limits that are zero, and make endless joints limited ones without range."""
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        is_endless = joint.get("type") == "continuous"
        if is_endless:
            joint.set("type", "revolute")
        if limit is None:
            continue
        if is_endless or not (set(PAIR) <= set(limit.attrib)) or all(_is_zero(limit.get(key)) for key in PAIR):
            _remove(limit, PAIR)
        _remove(limit, [key for key in ("effort", "velocity") if _is_zero(limit.get(key))])
        if not limit.attrib:
            joint.remove(limit)


def missing_limits(robot: ElementTree.Element) -> dict[str, set[str]]:
    """Return the missing attributes of `<limit>` by revolute joint; joints with all of them are left out."""
    found = {}
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        missing = set(PLACEHOLDER) - set({} if limit is None else limit.attrib)
        if joint.get("type") in ("revolute", "prismatic") and missing:
            found[joint.get("name", "")] = missing
    return found


def placeholders(missing: Mapping[str, set[str]]) -> dict[str, dict[str, float]]:
    """Return a placeholder for each missing limit, by joint and attribute."""
    return {joint: {key: PLACEHOLDER[key] for key in keys} for joint, keys in missing.items()}


def rotor_inertias(robot: ElementTree.Element) -> dict[str, str]:
    """Remove the rotors' inertias, which are no part of URDF, and return them by joint [kg·m²]."""
    found = {}
    for joint in robot.findall("joint"):
        for dynamics in joint.findall("dynamics"):
            armature = dynamics.attrib.pop("armature", None)
            if armature is not None:
                found[joint.get("name", "")] = armature
            if not dynamics.attrib:
                joint.remove(dynamics)
    return found


def _is_zero(text: str | None) -> bool:
    try:
        return text is not None and float(text) == 0.0
    except ValueError:
        return False


def _remove(limit: ElementTree.Element, keys: tuple[str, ...] | list[str]) -> None:
    for key in keys:
        limit.attrib.pop(key, None)
