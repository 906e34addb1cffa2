"""Command `exograv arm weigh` and the table of its result."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.live.options import ParticipantChoice
from exograv.options import ON_DRIVES, Acts, SegmentLengths, Sex
from exograv.procedures.weighing.options import WeighOptions

if TYPE_CHECKING:
    from exograv.laboratory.weighing_command import WeighResult
    from exograv.live.on_drives.weighing import WeighOnDrivesResult


@dataclass(frozen=True)
class WeighedPerson(ParticipantChoice):
    """Wearer of a machine on drives: a person whose arm is stored, or a form, apart from the body mass."""

    height_m: Annotated[float | None, tyro.conf.arg(name="body-height", metavar="M"), ON_DRIVES] = None
    """Body height of the wearer [m]; on drives only."""

    sex: Annotated[Sex | None, ON_DRIVES] = None
    """Sex whose table of body segments fits the wearer better; on drives only."""

    lengths: Annotated[SegmentLengths, ON_DRIVES] = ()
    """Measured length of an arm segment, to which the machine is adjusted [m], such as forearm=0.26; on drives only.
    Can be repeated."""


@dataclass(frozen=True)
class WeighedOnDrives(OutFolder):
    """Folder of a weighing on drives. The twin is weighed in memory."""

    out: Annotated[Path, Acts(lambda all_: all_.is_on_drives, "on drives; --json writes the figures of the twin")] = (
        Path("out")
    )
    """Folder of calibration and self-test, and of the recording; on drives only."""


def run_weigh_command(
    options: WeighOptions, person: WeighedPerson, common: WeighedOnDrives
) -> "WeighResult | WeighOnDrivesResult":
    """Check in twenty seconds if the arm fits the form; then weigh known weights in the hand and at the forearm."""
    if options.is_on_drives:
        return _on_drives(options, person, common.out)
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.weighing_command import run_weighing

    with bars() as progress:
        result = run_weighing(options, progress)
    show_weighing(result)
    return result


def _on_drives(options: WeighOptions, person: WeighedPerson, folder: Path) -> "WeighOnDrivesResult":
    from exograv.api.rig_factory import simulated_wearer
    from exograv.cli.shell.motion_note import say_motion
    from exograv.cli.shell.terminal import bars, say, say_unbroken
    from exograv.live.on_drives.weighing import run_weighing_on_drives
    from exograv.live.options import ReturningPerson

    refuse_unwritable(folder / "weigh.mcap", "--out")  # Checked now, not after minutes of preparation.
    say_motion(options.rig)
    form = ReturningPerson(
        participant=person.participant,
        participants=person.participants,
        height_m=person.height_m,
        mass_kg=options.body_mass_kg,
        sex=person.sex,
        lengths=person.lengths,
    )
    with bars() as progress:
        result = run_weighing_on_drives(options, form, folder, progress, say, simulated_wearer(options))
    _show_on_drives(result)
    say_kept(result.live)
    say_unbroken(f"Recording: {result.recording}")
    return result


def _show_on_drives(result: "WeighOnDrivesResult") -> None:
    rows = [
        (one.place, one.estimated_kg, one.ci95_kg, "" if one.stated_kg is None else f"{one.stated_kg:.3f}")
        for one in result.weights
    ]
    _show(result.why, result.arm_mass_kg, result.ci95_kg, "")
    _show_weights(f"{result.rig}, on drives", "stated, kg", rows)


def show_weighing(result: "WeighResult") -> None:
    """Print the verdict, then a table with one row per weight."""
    verdict = "REFUSED. " if result.refused else ""
    _show(verdict + result.why, result.arm_mass_kg, result.ci95_kg, f"; true {result.true_arm_mass_kg:.2f} kg")
    run = result.run
    rows = [
        (one.place, one.found.estimated_kg, one.found.ci95_kg, f"{one.found.true_kg:.3f}") for one in result.weights
    ]
    title = f"{run.rig}, disturbance level {run.disturbance_level}, world {run.world}, seed {run.seed}"
    _show_weights(title, "true, kg", rows)


def _show(verdict: str, arm_kg: float | None, ci95_kg: list[float] | None, truth: str) -> None:
    from rich.console import Console

    console = Console()
    console.print(verdict, highlight=False)
    if arm_kg is not None and ci95_kg is not None:
        low, high = ci95_kg
        console.print(f"Arm: {arm_kg:.2f} kg (95 %: {low:.2f} to {high:.2f}){truth}.", highlight=False)


def _show_weights(title: str, last: str, rows: list[tuple[str, float, list[float], str]]) -> None:
    from rich.console import Console
    from rich.table import Table

    if not rows:
        return
    table = Table(title=title)
    for heading in ("weight at the", "found, kg", "95 %, kg", last):
        table.add_column(heading, justify="right")
    for place, found, (low, high), known in rows:
        table.add_row(place, f"{found:.3f}", f"{low:.3f} to {high:.3f}", known)
    Console().print(table)
