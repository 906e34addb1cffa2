"""Choice of the joints that move the wearer's arm, by type, name and place in the tree."""

import re
from dataclasses import dataclass

from exograv.errors import ConfigError
from exograv.model.urdf import MOVING
from exograv.model.urdf_inference import sides_in
from exograv.options import Side

from .links import Links, child_of

OTHERS = {
    "a joint of the legs": r"hip(?!lex)|knee|ankle|(^|_)(leg|foot|toe|thigh|shank|calf)|subtalar|femur|tibia",
    "a joint of the fingers": r"finger|thumb|(^|_)index|(^|_)(pinky|mcp|pip|dip|cmc)(_|\d|$)|gripper|knuckle",
    "a joint of the trunk or its stand": r"torso|waist|trunk|spine|lumbar|chest|pelvis|backpack|column"
    r"|lift|stand_|wheel|caster",
    "a joint of the head": r"(^|_)(head|neck|camera)",
}
"""Parts of names that no joint of an arm has, by the reason for leaving a joint out."""


@dataclass(frozen=True)
class ArmJoints:
    """Joints that stay movable, and the reason for each other joint."""

    kept: tuple[str, ...]
    fixed: dict[str, str]


def arm_joints(links: Links, side: Side | None) -> ArmJoints:
    """Choose the joints of the arm or arms.

    Legs, fingers, trunk and head are left out by their names, slides and joints that follow others by their type, and
    the other arm by its name or its place. Of several branches the longest is kept.

    Raises:
        ConfigError: Several branches are the longest, and neither names nor places tell their sides.
    """
    fixed = {name: why for name, joint in links.joints.items() if (why := _reason(name, joint.get("type", ""), links))}
    moving = [name for name, joint in links.joints.items() if joint.get("type") != "fixed" and name not in fixed]
    sides = _sides(links, moving)
    kept: list[str] = []
    present = [one for one in ("right", "left") if one in sides.values()]
    wanted = [side] if side in ("right", "left") and side in present else (present if len(present) == 2 else [None])
    if wanted == [None]:
        _refuse_equal_chains(links, moving)
    for one in wanted:
        kept += _longest_chain(links, [name for name in moving if one is None or sides[name] in (one, None)])
    kept = [name for name in moving if name in kept]
    for name in moving:
        if name not in kept:
            other = sides[name] is not None and sides[name] not in wanted
            fixed[name] = "a joint of the other arm" if other and wanted != [None] else "on a side branch of the arm"
    return ArmJoints(tuple(kept), fixed)


def refuse_unnamed_arms(links: Links, kept: tuple[str, ...]) -> None:
    """Refuse two arms whose joints do not have their side in their names; they would be read as one arm.

    Raises:
        ConfigError: There are two such arms.
    """
    sides = _sides(links, list(kept))
    arms = {side: [name for name in kept if sides[name] == side] for side in ("right", "left")}
    if all(arms.values()) and any(side not in sides_in(name) for side, names in arms.items() for name in names):
        right, left = (_ends(names) for names in arms.values())
        raise ConfigError(
            f"The file has two arms, and the names of their joints do not tell the sides. {right} is taken as the "
            f"right arm and {left} as the left one, by the names of links or by place: y of the base points to the "
            "left. Repeat with --side right or --side left for one arm. For a machine for both arms, add right_ or "
            "left_ to the name of each joint."
        )


def _refuse_equal_chains(links: Links, moving: list[str]) -> None:
    chains = sorted(_chains(links, moving), key=len, reverse=True)
    rivals = [chain for chain in chains if len(chain) == len(chains[0])]
    apart = [chain for chain in rivals[1:] if _differ(chain, rivals[0])]
    if apart:
        names = "; ".join(_ends(chain) for chain in [rivals[0], *apart])
        raise ConfigError(
            f"The file has {len(apart) + 1} chains of {len(rivals[0])} joints that may be the arm: {names}. Neither "
            "right or left in their names nor their places tell the sides (y of the base points to the left). Name "
            "the joints of one arm with --joints."
        )


def _differ(chain: list[str], other: list[str]) -> bool:
    """Return True for two arms; the two jaws of a gripper differ in one joint only."""
    return len(set(chain) - set(other)) >= min(2, len(chain))


def _ends(chain: list[str]) -> str:
    return chain[0] if len(chain) == 1 else f"{chain[0]} to {chain[-1]}"


def _sides(links: Links, moving: list[str]) -> dict[str, str | None]:
    """Side of each joint by the names of joints and links, otherwise by the places of two equal branches."""
    sides = {name: _side(links, name) for name in moving}
    if len({one for one in sides.values() if one}) < 2:
        sides = _sides_by_place(links, moving) or sides
    return sides


def _reason(name: str, kind: str, links: Links) -> str:
    """Reason to leave out a joint by itself; empty if there is none."""
    if kind == "fixed":
        return ""
    if kind == "prismatic":
        return "a slide"
    if kind not in MOVING:
        return f"a {kind} base" if kind in ("floating", "planar") else f"of type '{kind}'"
    if links.joints[name].find("mimic") is not None:
        return "follows another joint"
    words = f"{name} {child_of(links.joints[name])}".lower()
    return next((why for why, pattern in OTHERS.items() if any(re.search(pattern, word) for word in words.split())), "")


def _side(links: Links, name: str) -> str | None:
    """Side in the name of a joint, its link or one before it; None if no name tells, or a name tells both."""
    for one in reversed(links.chain(name)):
        found = sides_in(one) | sides_in(child_of(links.joints[one]))
        if len(found) == 1:
            return next(iter(found))
    return None


def _sides_by_place(links: Links, moving: list[str]) -> dict[str, str | None] | None:
    """Return the sides of two equal branches by their y, which is to the left; None if there are no two."""
    chains = sorted(_chains(links, moving), key=len, reverse=True)
    if len(chains) < 2 or len(chains[0]) != len(chains[1]) or set(chains[0]) & set(chains[1]):
        return None
    mean = [sum(links.place(name)[1] for name in chain) / len(chain) for chain in chains[:2]]
    if mean[0] * mean[1] >= 0.0:
        return None
    found: dict[str, str | None] = dict.fromkeys(moving)
    for chain, y in zip(chains[:2], mean, strict=True):
        found |= dict.fromkeys(chain, "left" if y > 0.0 else "right")
    return found


def _chains(links: Links, moving: list[str]) -> list[list[str]]:
    """Return the chain of moving joints to each joint that carries no further one."""
    ends = [name for name in moving if not set(_moving_behind(links, name)) & set(moving)]
    return [[one for one in links.chain(end) if one in moving] for end in ends]


def _moving_behind(links: Links, name: str) -> list[str]:
    return [links.above[link] for link in links.subtree(child_of(links.joints[name]))[1:]]


def _longest_chain(links: Links, moving: list[str]) -> list[str]:
    return max(_chains(links, moving), key=len, default=[])
