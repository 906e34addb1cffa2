"""Command `exograv rig calibrate` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.motion_note import say_motion
from exograv.next_command import same_machine
from exograv.procedures.calibration.options import CalibrateOptions

if TYPE_CHECKING:
    from exograv.procedures.calibration.calibrate_command import CalibrationResult
    from exograv.procedures.calibration.figures import Interval


def run_calibrate_command(options: CalibrateOptions, common: OutFolder) -> "CalibrationResult":
    """Calibrate an empty machine: torque gains with known weights, friction, links, base tilt, encoder offsets."""
    from exograv.api.rig_factory import run_calibration
    from exograv.cli.shell.terminal import bars, say

    refuse_unwritable(options.calibration_in(common.out), "--calibration or --out")
    say_motion(options.rig)
    with bars() as progress:
        result = run_calibration(options, common.out, progress, say)
    show_calibration(result)
    if options.is_on_drives:
        say(f"Next: {same_machine('rig self-test', options, common.out)}")
    else:
        say(f"Next: {same_machine('demo', options, common.out, f'--calibration {result.file}')}")
    return result


def show_calibration(result: "CalibrationResult") -> None:
    """Print a table with one row per joint and intervals as plus or minus."""
    from rich.console import Console
    from rich.table import Table

    from exograv.cli.shell.terminal import say, say_unbroken

    found = result.figures
    table = Table(title=f"{result.rig} ({result.machine}); 95 % intervals, truth below")
    table.add_column("joint", min_width=9)
    for heading in ("gain\nN·m/A", "Coulomb\nN·m", "viscous\nN·m·s/rad", "break-\naway", "load\nshare", "encoder\n°"):
        table.add_column(heading, justify="right")
    for gain, friction, offset in zip(found.gain, found.friction, found.encoder_offset_deg, strict=True):
        cells = [_cell(gain.estimate, gain.ci95, gain.true)]
        cells += [
            _cell(getattr(friction, key), getattr(friction, f"{key}_ci95"), getattr(friction, f"{key}_true"))
            for key in ("coulomb_Nm", "viscous", "breakaway", "load_share")
        ]
        cells.append(_cell(offset.estimate, offset.ci95, offset.true))
        table.add_row(gain.joint.replace("_", "\n"), *cells)
    Console().print(table)
    lean = ", ".join(f"{row.estimate:+.2f}° {row.lean}" for row in found.tilt_deg)
    residual = ", ".join(f"{value:.2f}" for value in found.residual_sd_Nm)
    for line in (
        *result.warnings,
        f"The base is tilted by {lean}.",
        f"Residual torque: {residual} N·m.",
        f"{result.simulated_s:.0f} s of motion, in {result.wall_s:.0f} s.",
        f"Calibration {result.hash[:12]}… is in",
    ):
        say(line)
    say_unbroken(str(result.file))


def _cell(value: float, interval: "Interval", truth: float | None) -> str:
    half = 0.5 * (interval[1] - interval[0])
    return f"{value:.3g} (±{half:.1g})" + ("" if truth is None else f"\n{truth:.3g}")
