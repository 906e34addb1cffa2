"""Fixing of joints in a URDF at a position within their limits, and removal of links that load no joint of the arm."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from exograv.model.urdf import origin_of, vector_of
from exograv.model.urdf_writer import roll_pitch_yaw, words

from .arm_joints import ArmJoints
from .links import Links, child_of


def keep_joints(robot: ElementTree.Element, links: Links, found: ArmJoints) -> list[str]:
    """Fix every joint that is not kept. Return a sentence for each reason."""
    kept, reasons = set(found.kept), dict(found.fixed)
    for name, joint in links.joints.items():
        if name not in kept and joint.get("type") != "fixed":
            reasons.setdefault(name, "not named by --joints")
    places = {name: _fix(links.joints[name], name) for name in reasons}
    # A link that no kept joint moves loads none; with its branch it would only hide the arm in every picture.
    removed: set[str] = set()
    for name in reasons:
        branch = links.subtree(child_of(links.joints[name]))
        loads = any(one in kept for one in links.chain(name)) or any(links.above[link] in kept for link in branch)
        if not loads:
            removed |= set(branch)
    for link in removed:
        robot.remove(links.links[link])
        robot.remove(links.joints[links.above[link]])
    notes = []
    for why in dict.fromkeys(reasons.values()):
        names = [name for name, reason in reasons.items() if reason == why]
        gone = [name for name in names if child_of(links.joints[name]) in removed]
        stays = [f"{name} at {places[name]}" for name in names if name not in gone]
        parts = [f"left out {', '.join(gone)}"] if gone else []
        parts += [f"fixed {', '.join(stays)}"] if stays else []
        notes.append(f"{why[0].upper()}{why[1:]}: {'; '.join(parts)}.")
    return notes


def _fix(joint: ElementTree.Element, name: str) -> str:
    """Fix a joint at the position within its limits that is nearest to zero; return the position."""
    limit, kind = joint.find("limit"), joint.get("type", "")
    ends = [0.0, 0.0]
    if limit is not None and kind != "continuous":
        ends = [_plain(limit.get("lower")), _plain(limit.get("upper"))]
    position = float(np.clip(0.0, min(ends), max(ends)))
    if position and kind in ("prismatic", "revolute"):
        _shift(joint, name, position, kind)
    for tag in ("axis", "limit", "mimic", "dynamics", "calibration", "safety_controller"):
        for element in joint.findall(tag):
            joint.remove(element)
    joint.set("type", "fixed")
    return f"{1e3 * position:g} mm" if kind == "prismatic" else f"{np.rad2deg(position):g}°"


def _shift(joint: ElementTree.Element, name: str, position: float, kind: str) -> None:
    R, p = origin_of(joint, f"joint '{name}'", "")
    element = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if element is None else vector_of(element, "xyz", f"axis of joint '{name}'", "")
    if kind == "prismatic":
        p = p + R @ axis * position
    else:
        K = np.cross(np.eye(3), -axis).T
        R = R @ (np.eye(3) + np.sin(position) * K + (1.0 - np.cos(position)) * K @ K)
    set_origin(joint, R, p)


def set_origin(joint: ElementTree.Element, R: np.ndarray, p: np.ndarray) -> None:
    """Write the origin of a joint."""
    origin = joint.find("origin")
    origin = ElementTree.SubElement(joint, "origin") if origin is None else origin
    origin.set("xyz", words(p))
    origin.set("rpy", words(roll_pitch_yaw(R)))


def _plain(text: str | None) -> float:
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0
