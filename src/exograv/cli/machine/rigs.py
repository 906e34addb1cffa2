"""`exograv rigs`."""

from dataclasses import dataclass
from typing import Any

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class Rigs(Common):
    """List the machines that come with exograv."""


def run_rigs(_command: Rigs) -> dict[str, Any]:
    """List them."""
    from exograv.model.description import load_rig, rig_names

    rows = []
    for name in rig_names():
        description = load_rig(name)
        sides = description.settings.urdf.sides
        title, joints = description.settings.title, description.joints
        rows.append({"name": name, "title": title, "joints": list(joints), "sides": list(sides)})
        arms = "both arms" if sides == ("both",) else " or ".join(sides)
        print(f"{name}: {title} ({len(joints)} joints, {arms})")
    return {"rigs": rows}
