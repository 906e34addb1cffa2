"""Command `exograv doctor`: it checks this computer and the installed packages."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.results import MERGED, OPTIONAL

if TYPE_CHECKING:
    from exograv.procedures.self_test.loop_timing import LoopTest

    from .computer_check import ComputerCheck


@dataclass(frozen=True)
class Doctor:
    """Options of `exograv doctor`."""

    loop: float | None = None
    """Also run the live loop for this time [s], half of it with real-time rights, to test if a machine may be worn."""


@dataclass(frozen=True)
class DoctorResult:
    """Result of `exograv doctor`."""

    computer: "ComputerCheck" = field(metadata=MERGED)
    loop: "LoopTest | None" = field(metadata=OPTIONAL)


def run_doctor(command: Doctor, common: OutFolder) -> DoctorResult:
    """Check if this computer meets the requirements of exograv, and how fast its control loop is."""
    from exograv.cli.shell.terminal import bars, say, show_loop

    from .computer_check import examine_computer

    if command.loop is not None:
        from exograv.procedures.self_test.loop_timing import refuse_unusable

        refuse_unusable(command.loop)
    computer, loop = examine_computer(common.out), None
    say(computer.computer)
    for check in computer.checks:
        say(f"{'ok ' if check.ok else 'NO '} {check.name}: {check.text}")
    for extra, missing in computer.missing.items():
        state = f"not installed: {', '.join(missing)}" if missing else "installed"
        say(f"{'--- ' if missing else 'ok  '} exograv[{extra}]: {state}")
    if command.loop is not None and computer.has_all_it_needs:
        from exograv.procedures.self_test.loop_timing import loop_test

        with bars() as progress:
            loop = loop_test(command.loop, progress)
        show_loop(loop.figures)
    for line in next_steps(computer):
        say(line)
    return DoctorResult(computer, loop)


def next_steps(computer: "ComputerCheck") -> list[str]:
    """Return the verdict, the command that installs what is missing, and the first command to try."""
    if not computer.ok:
        return ["Correct what is marked NO, then run `exograv doctor` again."]
    missing = {extra for extra, packages in computer.missing.items() if packages}
    lines = ["exograv runs on this computer."]
    if missing:
        lines.append("Install an extra with: pip install 'exograv[NAME]', or everything with 'exograv[all]'.")
    needed = [extra for extra in ("twin", "study") if extra in missing]
    first = f"`exograv demo` needs exograv[{','.join(needed)}]." if needed else "Next: exograv demo"
    return [*lines, first]
