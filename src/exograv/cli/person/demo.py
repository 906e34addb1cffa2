"""Commands `exograv demo` and `exograv arm identify`."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.cli.shell.motion_note import say_motion, say_twin
from exograv.laboratory.options import ArmOptions, DemoOptions
from exograv.live.options import PersonForm
from exograv.procedures.identification.options import ParticipantOptions

if TYPE_CHECKING:
    from exograv.laboratory.demo_result import DemoResult
    from exograv.live.on_drives.identification import IdentifiedOnDrives


def run_demo_command(options: DemoOptions, files: ParticipantOptions, common: OutFolder) -> "DemoResult":
    """Identify a virtual arm in a virtual machine, float it, estimate a known weight, and write a report."""
    from exograv.cli.shell.terminal import bars, show_demo
    from exograv.laboratory.demo import run_demo

    if files.keep is not None:
        refuse_unwritable(files.keep, "--keep")
    if options.motion == "designed":
        say_motion(options.rig)
    say_twin(options.twin)
    with bars() as progress:
        result = run_demo(options, common.out, progress, files)
    show_demo(result)
    return result


def run_identify_command(
    options: ArmOptions, files: ParticipantOptions, person: PersonForm, common: OutFolder
) -> "DemoResult | IdentifiedOnDrives":
    """Identify the arm only: on the twin, which is calibrated first, or on drives, where it then floats for 5 s."""
    from exograv.api.rig_factory import run_identification
    from exograv.cli.machine.live import show_live
    from exograv.cli.shell.terminal import bars, say, show_demo
    from exograv.live.on_drives.identification import IdentifiedOnDrives

    if files.keep is not None:
        refuse_unwritable(files.keep, "--keep")
    if options.motion == "designed":
        say_motion(options.rig)
    say_twin(options.twin)
    with bars() as progress:
        result = run_identification(options, files, person, common.out, progress, say)
    if isinstance(result, IdentifiedOnDrives):
        show_live(result.live)
        show_kept(result)
    else:
        show_demo(result)
    return result


def show_kept(result: "IdentifiedOnDrives") -> None:
    """Print the file of the arm, or why there is none."""
    from exograv.cli.shell.terminal import say

    if result.live.identified is None:
        say("The identification did not finish. The reason is printed above.")
    else:
        say_kept(result.live)
