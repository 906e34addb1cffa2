"""`exograv calibrate`."""

from typing import Any

from exograv.cli.shell.base_options import Common, refuse_unwritable
from exograv.procedures.calibration.options import CalibrateOptions


def run_calibrate_command(options: CalibrateOptions, common: Common) -> dict[str, Any]:
    """Measure an empty machine: torque gains with known weights, friction, links, the base's lean, encoder offsets."""
    from exograv.cli.shell.terminal import bars, say

    from .rig_factory import run_calibration

    refuse_unwritable(options.calibration_in(common.out), "--calibration or --out")
    with bars() as progress:
        result = run_calibration(options, common.out, progress, say)
    show_calibration(result)
    return result


def show_calibration(result: dict[str, Any]) -> None:
    """One row a joint; intervals as plus or minus."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result['rig']} ({result['machine']}); 95 % intervals, truth below")
    table.add_column("joint", min_width=9)
    for heading in ("gain\nN·m/A", "Coulomb\nN·m", "viscous\nN·m·s/rad", "break-\naway", "load\nshare", "encoder\n°"):
        table.add_column(heading, justify="right")
    for gain, friction, offset in zip(result["gain"], result["friction"], result["encoder_offset_deg"], strict=True):
        cells = [_cell(gain["estimate"], gain["ci95"], gain.get("true"))]
        cells += [
            _cell(friction[key], friction[f"{key}_ci95"], friction.get(f"{key}_true"))
            for key in ("coulomb_Nm", "viscous", "breakaway", "load_share")
        ]
        cells.append(_cell(offset["estimate"], offset["ci95"], offset.get("true")))
        table.add_row(gain["joint"].replace("_", "\n"), *cells)
    console = Console()
    console.print(table)
    lean = ", ".join(f"{row['estimate']:+.2f}° {row['lean']}" for row in result["tilt_deg"])
    residual = ", ".join(f"{value:.2f}" for value in result["residual_sd_Nm"])
    for line in (
        *result["warnings"],
        f"The base leans by {lean}.",
        f"Unexplained of the torque: {residual} N·m.",
        f"{result['simulated_s']:.0f} s of motion, in {result['wall_s']:.0f} s.",
        f"Calibration {result['hash'][:12]}… is in",
    ):
        console.print(line, highlight=False)
    console.print(result["file"], highlight=False, soft_wrap=True)


def _cell(value: float, interval: list[float], truth: float | None) -> str:
    half = 0.5 * (interval[1] - interval[0])
    return f"{value:.3g} (±{half:.1g})" + ("" if truth is None else f"\n{truth:.3g}")
