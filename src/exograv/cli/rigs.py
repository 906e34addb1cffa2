"""`exograv rigs`."""

from dataclasses import dataclass
from typing import Any

from .common import Common


@dataclass(frozen=True)
class Rigs(Common):
    """List the machines that come with exograv."""


def run_rigs(_command: Rigs) -> dict[str, Any]:
    """List them."""
    from exograv.model.description import load_rig, rig_names

    rows = []
    for name in rig_names():
        description = load_rig(name)
        rows.append({"name": name, "title": description.settings.title, "joints": list(description.joints)})
        print(f"{name}: {description.settings.title} ({len(description.joints)} joints, right or left)")
    return {"rigs": rows}
