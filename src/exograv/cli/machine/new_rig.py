"""Command `exograv rig new`."""

from pathlib import Path
from typing import TYPE_CHECKING

from exograv.procedures.machine_tools.options import NewRigOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.new_rig import NewRig


def run_new_rig(options: NewRigOptions) -> "NewRig":
    """Write a folder for your own machine, with values from its URDF or MJCF and a question for each missing value."""
    from exograv.procedures.machine_tools.new_rig import new_rig

    result = new_rig(options, _urdf_of_mjcf)
    for note in result.notes:
        print(note)
    for question in result.questions:
        print(f"line {question.line}, {question.key}: {question.comment}")
    print(
        f"{result.folder}: rig.toml for {len(result.joints)} joints, with {len(result.questions)} questions. "
        f"Answer them there, then run `exograv rig check {result.folder}`."
    )
    return result


def _urdf_of_mjcf(path: Path) -> str:
    """Return an MJCF file as URDF; only this needs MuJoCo."""
    from exograv.rig.twin.machine.mjcf_machine import urdf_of_mjcf

    return urdf_of_mjcf(path)
