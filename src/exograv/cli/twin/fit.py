"""Command `exograv twin fit` and the tables of its result."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.procedures.machine_twin.options import TwinFitOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_twin.fit_command import TwinFitResult
    from exograv.report.figures.twin_fit_data import FittedParameter, TwinFigures

COLUMNS = {
    "inverse_gain": "1/gain\nnominal",
    "coulomb": "Coulomb\nN·m",
    "viscous": "viscous\nN·m·s",
    "breakaway": "break-\naway",
    "load_share": "load\nshare",
    "asymmetry": "asym.\nN·m",
    "rotor": "rotor\nkg·m²",
}
"""Headings of the parameters in the table."""


def run_twin_fit(options: TwinFitOptions, common: OutFolder) -> "TwinFitResult":
    """Fit the twin of a machine to recordings of it empty: links, friction, rotors, delay, noise, with intervals."""
    from exograv.cli.shell.terminal import bars, say, say_unbroken
    from exograv.procedures.machine_twin.fit_command import fit_and_write

    refuse_unwritable(common.out / "twin.toml", "--out")
    with bars() as progress:
        result = fit_and_write(options, common.out, progress)
    show_fit(result.figures)
    say("The machine with its twin is in")
    say_unbroken(str(result.folder))
    say(f"{result.figures.recorded_s:.0f} s of recordings, fitted in {result.wall_s:.0f} s. The page of the fit is")
    say_unbroken(str(result.report))
    say(f"Next: exograv demo {result.folder} --twin fitted")
    return result


def show_fit(figures: "TwinFigures") -> None:
    """Print residuals against noise, parameters with intervals, and what further motion would tell."""
    from rich.console import Console
    from rich.table import Table

    from exograv.cli.shell.terminal import say

    console = Console()
    table = Table(title=f"Residual torque on the held-out {figures.held_out_s:.0f} s, N·m")
    table.add_column("joint")
    table.add_column("law of friction", overflow="fold")
    for heading in ("per tick", "noise", "over\nnoise", "below\n7 Hz"):
        table.add_column(heading, justify="right")
    for row in figures.held_out:
        values = (row.rms_Nm, row.noise_Nm, row.over_noise, row.slow_rms_Nm)
        table.add_row(row.joint.replace("_", "\n"), row.law, *(f"{value:.3g}" for value in values))
    console.print(table)
    table = Table(title="Parameters; 95 % intervals; share that the recordings tell below")
    table.add_column("joint", min_width=9)
    for heading in COLUMNS.values():
        table.add_column(heading, justify="right")
    for joint in (row.joint for row in figures.held_out):
        known = {row.parameter: row for row in figures.parameters if row.joint == joint}
        table.add_row(joint.replace("_", "\n"), *(_cell(known.get(name)) for name in COLUMNS))
    console.print(table)
    for line in _sentences(figures):
        say(line)


def _sentences(figures: "TwinFigures") -> Iterator[str]:
    """Yield delay, gains by temperature, cuffs, encoders, warnings, and motions that would tell more."""
    if figures.delay_ms is not None and figures.delay_ci95_ms is not None:
        bandwidth = ", ".join("–" if value is None else f"{value:.0f}" for value in figures.bandwidth_Hz)
        low, high = figures.delay_ci95_ms
        yield f"Delay {figures.delay_ms:.2f} ms (95 %: {low:.2f} to {high:.2f}); bandwidth {bandwidth} Hz."
    for row in figures.gain_by_temperature:
        if row.percent_per_C is not None and row.ci95_percent_per_C is not None:
            low, high = row.ci95_percent_per_C
            yield f"Gain of '{row.joint}': {row.percent_per_C:+.2f} %/°C (95 %: {low:+.2f} to {high:+.2f})."
    for row in figures.cuffs:
        low, high = row.ci95
        yield (
            f"Cuffs, {row.direction}: {row.factor:.2f} times the stiffness in rig.toml "
            f"(95 %: {low:.2f} to {high:.2f}); the recordings tell {row.learned:.0%}."
        )
    if not figures.has_motor_encoders:
        yield "The recordings hold no positions of the motors: the twin has no encoders on its motors."
    yield from (*figures.warnings, *figures.further_motion)


def _cell(row: "FittedParameter | None") -> str:
    if row is None:
        return "–"
    half = 0.5 * (row.ci95[1] - row.ci95[0])
    return f"{row.estimate:.3g}\n±{half:.1g}\n{row.learned:.0%}"
