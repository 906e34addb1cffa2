"""Command `exograv arm verify` and the table of its result."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.live.options import ReturningPerson
from exograv.options import Acts
from exograv.procedures.verification.options import VerifyOptions

if TYPE_CHECKING:
    from exograv.procedures.verification.figures import VerifyResult


@dataclass(frozen=True)
class VerifiedOnDrives(OutFolder):
    """Folder of a verification on drives. The twin is verified in memory."""

    out: Annotated[Path, Acts(lambda all_: all_.is_on_drives, "on drives; --json writes the figures of the twin")] = (
        Path("out")
    )
    """Folder of calibration and self-test, and of the recording; on drives only."""


def run_verify_command(options: VerifyOptions, person: ReturningPerson, common: VerifiedOnDrives) -> "VerifyResult":
    """Measure what is left over of the arm's weight at twelve postures that the identification did not visit."""
    from exograv.api.rig_factory import run_verification
    from exograv.cli.shell.terminal import bars, say
    from exograv.live.live_figures import LiveFigures

    if options.is_on_drives:
        refuse_unwritable(common.out / "live.mcap", "--out")
    with bars() as progress:
        result = run_verification(options, person, common.out, progress, say)
    show_verification(result)
    if isinstance(result.live, LiveFigures):
        say_kept(result.live)
    return result


def show_verification(result: "VerifyResult") -> None:
    """Print a table with one row per joint, then the fingertip, the verdict and the change since an earlier result."""
    from rich.console import Console
    from rich.table import Table

    from exograv.cli.shell.terminal import say

    level, found = result.disturbance_level, result.found
    drawn = "" if level is None else f", disturbance level {level}, world {result.world}"
    table = Table(title=f"{result.rig}{drawn}, seed {result.seed}")
    for heading in ("left over, N·m RMS", "found", "95 %", "target", "truth"):
        table.add_column(heading, justify="left" if heading.startswith("left") else "right")
    truths = result.truth_Nm or [None] * len(found.joints)
    columns = found.joints, found.left_over_Nm, found.ci95, found.target_Nm, truths
    for joint, value, (low, high), target, truth in zip(*columns, strict=True):
        table.add_row(
            joint, f"{value:.3f}", f"{low:.3f} to {high:.3f}", f"{target:.2f}", "" if truth is None else f"{truth:.3f}"
        )
    Console().print(table)
    low, high = found.fingertip_ci95_mm
    say(
        f"The left over moves the unseen fingertip of a relaxed person by {found.fingertip_mm:.1f} mm "
        f"(95 %: {low:.1f} to {high:.1f}). {len(found.postures)} postures, {found.motion_s:.0f} s of motion."
    )
    say(found.why)
    if result.before is not None:
        say(f"Since {result.before.minutes:.0f} min: {result.before.why}")
