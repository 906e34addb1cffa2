"""Command `exograv run train` and the printout of its result."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.motion_note import say_twin
from exograv.console.options import Address
from exograv.experiment.train.options import TrainOptions
from exograv.live.options import PersonForm
from exograv.next_command import same_machine
from exograv.options import ON_DRIVES

if TYPE_CHECKING:
    from exograv.console.train_on_drives import DrivenTraining
    from exograv.experiment.train.train_command import MachineFor, TrainResult
    from exograv.loop.pilot import Progress


@dataclass(frozen=True)
class TrainingPages(Address):
    """Address of the participant's page in a session on drives."""

    port: Annotated[int, ON_DRIVES] = 8088
    """TCP port of the participant's page; 0 for a free port; on drives only."""

    browser: tyro.conf.Fixed[bool] = False
    """No page is opened: the operator is at the terminal."""

    lan: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS"), ON_DRIVES] = None
    """Serve tablets too, at this address or name of the computer. This needs a certificate; on drives only."""

    certificate: Annotated[Path | None, ON_DRIVES] = None
    """Certificate for TLS as a PEM file, with `--lan`."""

    key: Annotated[Path | None, ON_DRIVES] = None
    """Private key of the certificate as a PEM file, with `--lan`."""


def run_train_command(
    options: TrainOptions, person: PersonForm, pages: TrainingPages, common: OutFolder
) -> "TrainResult | DrivenTraining":
    """Run a session of a protocol: on drives with a person, or with a virtual participant.

    On drives the operator is at this terminal, and the participant touches a page (docs/howto/train.md).
    """
    from exograv.cli.shell.terminal import bars, say_unbroken

    if options.is_on_drives and not options.virtual_clock:
        from exograv.api.rig_factory import steered_flight
        from exograv.console.train_on_drives import run_training_on_drives

        driven = run_training_on_drives(options, person, pages, common.out, say_unbroken, steered_flight)
        show_driven(driven)
        say_unbroken(f"Next: {same_machine('next', options, common.out, f'--participant {options.participant}')}")
        return driven
    from exograv.experiment.train.train_command import how_to_go_on, run_training

    if options.person_file is not None:
        refuse_unwritable(options.person_file, "--person-file")
    say_twin(options.twin)
    try:
        with bars() as progress:
            result = run_training(options, common.out, progress, _machine_of(options, common.out, progress))
    except KeyboardInterrupt:
        print(f"\n{how_to_go_on(options, common.out)}", file=sys.stderr)
        raise
    show_training(result)
    return result


def _machine_of(options: TrainOptions, folder: Path, progress: "Progress") -> "MachineFor | None":
    """Return the function that connects the simulated drives of a session on a virtual clock; None for the twin."""
    if not options.virtual_clock:
        return None
    from exograv.cli.shell.terminal import say_unbroken
    from exograv.experiment.train.drives_machine import DrivesMachine

    return lambda asked, before: DrivesMachine(options, asked, before, folder, progress, say_unbroken)


def show_driven(result: "DrivenTraining") -> None:
    """Print the identification, the windows and the touches of a session on drives."""
    from exograv.cli.shell.terminal import say, say_unbroken

    if result.preparation is not None:
        begun = "the participant's file" if result.preparation.from_file else "the table"
        say(f"Identification from {begun}: {result.preparation.identified}")
    if (touched := result.totals) is not None:
        median = touched.deviation_px.median
        say(
            f"{touched.windows} windows, {touched.accepted} of {touched.touches} touches counted; median deviation "
            f"{'unknown' if median is None else f'{median:.1f} px'}."
        )
    say("The protocol has come to its end." if result.is_complete else "The protocol has not come to its end.")
    for recording in result.recordings:
        say_unbroken(f"Recording: {recording}")
    if result.report is not None:
        say_unbroken(f"Report: {result.report}")
    if result.diary is not None:
        say_unbroken(f"Diary of the pages: {result.diary}")


def show_training(result: "TrainResult") -> None:
    """Print deviations, counts of touches, and the path of the report."""
    from rich.console import Console
    from rich.table import Table

    touched = result.touched
    table = Table(title=f"{result.protocol}, participant {result.participant}, session {result.session}")
    for heading in ("", "median", "quarter below", "quarter above"):
        table.add_column(heading, justify="right" if heading else "left")
    for unit, found in (("px", touched.deviation_px), ("mm", touched.deviation_mm)):
        values = (found.median, found.q1, found.q3)
        table.add_row(f"deviation, {unit}", *("-" if value is None else f"{value:.1f}" for value in values))
    console = Console()
    console.print(table)
    rejected = ", ".join(f"{count} {reason}" for reason, count in touched.rejected.items()) or "none"
    per_window = touched.touches_per_window.median
    lines = [
        f"{touched.windows} windows, {touched.accepted} of {touched.touches} touches counted "
        f"(rejected: {rejected}); median {'no' if per_window is None else f'{per_window:g}'} touches per window.",
        f"{result.session_s:.0f} s of session, {result.simulated_s:.0f} s of them simulated tick by tick, in "
        f"{result.wall_s:.0f} s; {result.recording_MB:g} MB.",
    ]
    lines += [f"Check after window {one.after_windows}: {one.why}" for one in result.preparation.checked or []]
    lines += [f"Rest after window {one.after_windows}: {one.why}" for one in result.preparation.learned or []]
    if result.preparation.learned and result.preparation.person_kept:
        lines.append("The arm is stored in the person's file.")
    if not result.is_whole_protocol:
        lines.insert(0, "Only a part of the protocol was run (--windows).")
    for line in lines:
        console.print(line, highlight=False)
    console.print(f"Report: {result.report}", highlight=False, soft_wrap=True)
