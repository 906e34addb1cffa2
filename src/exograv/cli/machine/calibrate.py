"""`exograv calibrate`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common, refuse_unwritable


@dataclass(frozen=True)
class Calibrate(Common):
    """Measure an empty machine: torque gains with known weights, friction, links, the base's lean, encoder offsets."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    calibration: Path | None = None
    """File to keep the calibration in; calibration.toml in the folder of --out if none is named."""

    recheck: bool = False
    """Only check friction again, for the calibration in that file; its gains stay."""

    drives: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """drives.toml of a real machine, empty and hanging, whose bring-up has passed (docs/rig_test.md)."""

    simulate: bool = False
    """Practise on simulated drives in another process, with weights that are simulated too."""

    length: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="SEGMENT=M")] = ()
    """With --drives: what the machine is set to, such as forearm=0.26; nominal if not named. May be repeated."""


def run_calibrate_command(command: Calibrate) -> dict[str, Any]:
    """Run it and show what was found."""
    from rich.console import Console

    from exograv.cli.shell.terminal import bars
    from exograv.procedures.calibration.calibrate_command import FILE, CalibrateOptions

    from .rig_factory import run_calibration

    file = command.calibration or command.out / FILE
    options = CalibrateOptions(
        command.rig, command.side, command.level, command.seed, file, command.recheck, command.drives,
        command.simulate, command.length,
    )  # fmt: skip
    refuse_unwritable(file, "--calibration or --out")
    console = Console()
    with bars() as progress:
        result = run_calibration(options, progress, lambda text: console.print(text, highlight=False))
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
