"""`exograv new-rig`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class NewRig(Common):
    """Write a folder for your own machine: what its URDF tells, and a question for everything else."""

    urdf: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """The machine's description; it is copied, without its pictures and collision shapes."""

    out: Path = Path()
    """Folder to write, which must not exist; called like the robot, in this folder, if none is named."""

    side: Literal["right", "left", "both"] | None = None
    """Which arm it is for; by the names in the URDF if not given."""


def run_new_rig(command: NewRig) -> dict[str, Any]:
    """Write it and say what is left to answer."""
    from exograv.procedures.machine_tools.new_rig import NewRigOptions, new_rig

    folder = None if command.out == Path() else command.out
    result = new_rig(NewRigOptions(command.urdf, folder, command.side))
    for question in result["questions"]:
        print(f"line {question['line']}, {question['key']}: {question['comment']}")
    print(
        f"{result['folder']}: rig.toml for {len(result['joints'])} joints, with {len(result['questions'])} questions. "
        f"Answer them there, then run `exograv check-rig {result['folder']}`."
    )
    return result
