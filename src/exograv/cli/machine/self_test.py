"""Command `exograv rig self-test` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.next_command import same_machine
from exograv.procedures.self_test.options import SelfTestOptions

if TYPE_CHECKING:
    from exograv.procedures.self_test.self_test_command import SelfTestResult


def run_self_test_command(options: SelfTestOptions, common: OutFolder) -> "SelfTestResult":
    """Test the empty machine and this computer before a person wears it: each day, and after every stop by a fault."""
    from exograv.api.rig_factory import run_self_test
    from exograv.cli.shell.terminal import bars, say

    refuse_unwritable(common.out / "self_test.mcap", "--out")
    with bars() as progress:
        result = run_self_test(options, common.out, progress, say)
    show_self_test(result)
    if options.is_on_drives and result.self_test.startswith("passed"):
        person = "" if options.simulate else " --body-height M --body-mass KG --sex female"
        say(f"Next: {same_machine('run live', options, common.out, f'--identify 60{person}')}")
    return result


def show_self_test(result: "SelfTestResult") -> None:
    """Print a table with one row per step, and the verdict."""
    from exograv.cli.shell.terminal import say, show_steps

    title = f"Self-test of {result.rig}, {result.machine_s:.0f} s of the machine"
    show_steps(title, [(step.name, step) for step in result.steps])
    verdict = "The machine has passed." if result.ok else "The machine is refused."
    if result.ok and not result.may_be_worn:
        verdict += " It must not be worn: the timing of this computer is not good enough."
    say(f"{verdict} Lock: {result.self_test}.")
