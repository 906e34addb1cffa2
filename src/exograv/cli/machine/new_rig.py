"""Command `exograv rig new`."""

from typing import TYPE_CHECKING

from exograv.procedures.machine_tools.options import NewRigOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.new_rig import NewRig


def run_new_rig(options: NewRigOptions) -> "NewRig":
    """Write a folder for your own machine, with values from its URDF and a question for each missing value."""
    from exograv.procedures.machine_tools.new_rig import new_rig

    result = new_rig(options)
    for question in result.questions:
        print(f"line {question.line}, {question.key}: {question.comment}")
    print(
        f"{result.folder}: rig.toml for {len(result.joints)} joints, with {len(result.questions)} questions. "
        f"Answer them there, then run `exograv rig check {result.folder}`."
    )
    return result
