"""URDF with the joint limits that only `rig.toml` gives."""

import math
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from typing import Any

from .rig_settings import written_out

PLACEHOLDER = {"lower": -math.pi, "upper": math.pi, "effort": 1.0, "velocity": 1.0}
"""Limits of a joint whose limits are still asked for [rad, N·m, rad/s]; for `exograv rig new` and `check` only."""

ATTRIBUTES = {"range_deg": ("lower", "upper"), "torque_max_Nm": ("effort",), "speed_max_deg_s": ("velocity",)}
"""Attributes of a URDF's `<limit>` by the key of `rig.toml`."""


def completed_urdf(text: str, limits: Mapping[str, Mapping[str, float]]) -> str:
    """Return the text of a URDF with `limits` by joint and attribute, where the file has none.

    A text that needs no limit is returned unchanged. A text that is no XML is returned unchanged too; its reader says
    what is wrong.
    """
    try:
        robot = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError):
        return text
    is_changed = False
    for joint in robot.findall("joint"):
        given = limits.get(joint.get("name", ""), {})
        limit = joint.find("limit")
        missing = {key: value for key, value in given.items() if limit is None or key not in limit.attrib}
        if missing:
            limit = ElementTree.SubElement(joint, "limit") if limit is None else limit
            limit.attrib.update({key: repr(value) for key, value in missing.items()})
            is_changed = True
    return ElementTree.tostring(robot, encoding="unicode") if is_changed else text


def unfinished_limits(text: str) -> dict[str, dict[str, float]]:
    """Return the limits by joint in the text of a `rig.toml`, with a placeholder for each open question.

    Raises:
        ValueError: The text is not TOML, or its table [drives] has a wrong key.
    """
    return limits_of(written_out(tomllib.loads(text)).get("actuators"), is_unfinished=True)


def limits_of(actuators: Any, *, is_unfinished: bool = False) -> dict[str, dict[str, float]]:
    """Return the limits by joint in the tables [[actuators]] of a `rig.toml`, in the units of URDF.

    Args:
        actuators: Tables as they are in the file, with the values of [drives].
        is_unfinished: True gives a placeholder for each value that is asked for or wrong.
    """
    found: dict[str, dict[str, float]] = {}
    for one in actuators if isinstance(actuators, list) else []:
        joint, limits = (one.get("joint"), {}) if isinstance(one, dict) else (None, {})
        if not isinstance(joint, str):
            continue
        for key, name in (("torque_max_Nm", "effort"), ("speed_max_deg_s", "velocity")):
            value = one.get(key)
            if isinstance(value, (int, float)) and value > 0:
                limits[name] = float(value) if name == "effort" else math.radians(value)
        match one.get("range_deg"):
            case [int() | float() as lower, int() | float() as upper] if lower < upper:
                limits |= {"lower": math.radians(lower), "upper": math.radians(upper)}
            case _:
                pass
        if is_unfinished:
            asked = [name for key, names in ATTRIBUTES.items() if key in one for name in names]
            limits = {name: PLACEHOLDER[name] for name in asked} | limits
        found[joint] = limits
    return found
