"""`exograv weigh`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class Weigh(Common):
    """Twenty seconds to find out whether the arm fits the form; then known weights in the hand and at the forearm."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    hand_weight: Annotated[float | None, tyro.conf.arg(metavar="KG")] = None
    """Weight that the virtual wearer takes into the hand [kg], hidden from the software; drawn if none is given, 0 for
    none."""

    forearm_weight: Annotated[float, tyro.conf.arg(metavar="KG")] = 0.0
    """The same at the middle of the forearm [kg]."""

    body_mass: Annotated[float | None, tyro.conf.arg(metavar="KG")] = None
    """Body mass as the operator typed it [kg]; the wearer's own if none is given."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the machine is calibrated first."""


def run_weigh_command(command: Weigh) -> dict[str, Any]:
    """Run it and say what was found."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.weighing_command import WeighOptions, run_weighing

    options = WeighOptions(
        command.rig,
        command.side,
        command.level,
        command.seed,
        command.hand_weight,
        command.forearm_weight,
        command.body_mass,
        command.calibration,
    )
    with bars() as progress:
        result = run_weighing(options, progress)
    show_weighing(result)
    return result


def show_weighing(result: dict[str, Any]) -> None:
    """The verdict first; then one row a weight."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    verdict = "REFUSED. " if result["refused"] else ""
    console.print(verdict + result["why"], highlight=False)
    if result["arm_mass_kg"] is not None:
        low, high = result["ci95_kg"]
        console.print(
            f"Arm: {result['arm_mass_kg']:.2f} kg (95 %: {low:.2f} to {high:.2f}); "
            f"true {result['true_arm_mass_kg']:.2f} kg.",
            highlight=False,
        )
    if not result["weights"]:
        return
    table = Table(title=f"{result['rig']}, disturbance level {result['disturbance_level']}, seed {result['seed']}")
    for heading in ("weight at the", "found, kg", "95 %, kg", "true, kg"):
        table.add_column(heading, justify="right")
    for row in result["weights"]:
        low, high = row["ci95_kg"]
        table.add_row(row["place"], f"{row['estimated_kg']:.3f}", f"{low:.3f} to {high:.3f}", f"{row['true_kg']:.3f}")
    console.print(table)
