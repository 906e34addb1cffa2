"""Command `exograv rigs`: it lists the machines that ship with the package."""

from typing import Any


def run_rigs() -> dict[str, Any]:
    """List the machines that come with exograv."""
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
