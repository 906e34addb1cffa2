"""Commands `exograv demo` and `exograv arm identify`."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.laboratory.options import DemoOptions, IdentifyOptions
from exograv.procedures.identification.options import ParticipantOptions

if TYPE_CHECKING:
    from exograv.laboratory.demo_result import DemoResult


def run_demo_command(options: DemoOptions, files: ParticipantOptions, common: OutFolder) -> "DemoResult":
    """Identify a virtual arm in a virtual machine, float it, estimate a known weight, and write a report."""
    from exograv.cli.shell.terminal import bars, show_demo
    from exograv.laboratory.demo import run_demo

    if files.keep is not None:
        refuse_unwritable(files.keep, "--keep")
    with bars() as progress:
        result = run_demo(options, common.out, progress, files)
    show_demo(result)
    return result


def run_identify_command(options: IdentifyOptions, files: ParticipantOptions, common: OutFolder) -> "DemoResult":
    """Calibrate the empty machine and identify the arm only."""
    return run_demo_command(DemoOptions(**vars(options), only_identify=True), files, common)
