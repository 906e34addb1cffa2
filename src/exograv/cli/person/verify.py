"""`exograv verify`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from exograv.cli.machine.on_drives import WornOnDrives, say
from exograv.cli.shell.base_options import refuse_unwritable

if TYPE_CHECKING:
    from exograv.loop.pilot import Progress
    from exograv.procedures.verification.options import VerifyOptions


@dataclass(frozen=True)
class Verify(WornOnDrives):
    """What is left over of the arm's weight at twelve postures that nobody learned from, measured by slow passes."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the twin is calibrated first.
    On drives the one in the folder of --out."""

    before: Path | None = None
    """Figures of a former verification (its --json): says what changed since, and whether by more than chance."""

    later: Annotated[float, tyro.conf.arg(metavar="MIN")] = 0.0
    """On the twin: so many minutes the machine runs between identification and verification; friction warms [min]."""


def run_verify_command(command: Verify) -> dict[str, Any]:
    """Run it and say what is left over."""
    from exograv.cli.shell.terminal import bars
    from exograv.procedures.verification.options import VerifyOptions

    options = VerifyOptions(
        command.rig, command.side, command.level, command.seed, command.calibration, command.before, command.later
    )
    if command.is_on_drives:
        refuse_unwritable(command.out / "live.mcap", "--out")
    with bars() as progress:
        run = _on_drives if command.is_on_drives else _on_twin
        result = run(command, options, progress)
    show_verification(result)
    return result


def _on_twin(_command: Verify, options: "VerifyOptions", progress: "Progress") -> dict[str, Any]:
    from exograv.cli.machine.rig_factory import run_verification

    return run_verification(options, progress)


def _on_drives(command: Verify, options: "VerifyOptions", progress: "Progress") -> dict[str, Any]:
    from exograv.cli.machine.rig_factory import simulated_wearer
    from exograv.errors import ConfigError
    from exograv.live.on_drives.verification import Files, run_verification_on_drives

    if command.later:
        raise ConfigError(f"--later is {command.later:g}; on drives time passes by itself. Leave it out.")
    files = Files(command.calibration or command.out / "calibration.toml", command.out)
    asked = command.asked(command.level)
    wearer = simulated_wearer(asked, command.rig, command.side)
    return run_verification_on_drives(options, asked, command.person(), files, progress, say, wearer)


def show_verification(result: dict[str, Any]) -> None:
    """One row a joint; then the fingertip, the verdict and what changed."""
    from rich.console import Console
    from rich.table import Table

    level = result["disturbance_level"]
    drawn = "" if level is None else f", disturbance level {level}"
    table = Table(title=f"{result['rig']}{drawn}, seed {result['seed']}")
    for heading in ("left over, N·m RMS", "found", "95 %", "target", "truth"):
        table.add_column(heading, justify="left" if heading.startswith("left") else "right")
    truths = result["truth_Nm"] or [None] * len(result["joints"])
    columns = (*(result[name] for name in ("joints", "left_over_Nm", "ci95", "target_Nm")), truths)
    for joint, value, (low, high), target, truth in zip(*columns, strict=True):
        table.add_row(
            joint, f"{value:.3f}", f"{low:.3f} to {high:.3f}", f"{target:.2f}", "" if truth is None else f"{truth:.3f}"
        )
    console = Console()
    console.print(table)
    low, high = result["fingertip_ci95_mm"]
    console.print(
        f"An unseen fingertip of a person at ease is moved by {result['fingertip_mm']:.1f} mm "
        f"(95 %: {low:.1f} to {high:.1f}). {len(result['postures'])} postures, {result['motion_s']:.0f} s of motion.",
        highlight=False,
    )
    console.print(result["why"], highlight=False)
    if "before" in result:
        console.print(f"Since {result['before']['minutes']:.0f} min: {result['before']['why']}", highlight=False)
