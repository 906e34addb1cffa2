"""`exograv design-motion`."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class DesignMotion(Common):
    """Design the motion that tells most about an arm in a machine, and print the block for its rig.toml."""

    rig: Annotated[str, tyro.conf.Positional] = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    height_m: float = 1.70
    """Of the person it is designed for [m]."""

    mass_kg: float = 70.0
    """Of that person [kg]."""

    sex: Literal["female", "male"] = "female"
    """By which table."""

    seconds: float = 300.0
    """How long to search [s]; what is not reached by then is left out, and the result may differ between computers."""

    period_s: float = 30.0
    """After which the motion repeats itself [s]."""

    harmonics: int = 8
    """Of that period."""

    starts: int = 4
    """Random starts beside the machine's present motion: loops, and motions that come back the way they went."""


def run_design_motion(command: DesignMotion) -> dict[str, Any]:
    """Design it, draw it, print the block."""
    from exograv.cli.shell.terminal import bars
    from exograv.procedures.machine_tools.design_motion import DesignOptions, design_motion, excitation_text
    from exograv.report.figures.excitation import write_picture

    options = DesignOptions(
        command.rig,
        command.side,
        command.height_m,
        command.mass_kg,
        command.sex,
        command.seconds,
        command.period_s,
        command.harmonics,
        command.starts,
        seed=command.seed,
    )
    with bars() as progress:
        designed = design_motion(options, progress)
    result = designed.figures
    path = designed.path
    picture = write_picture(
        command.out / "motion.svg", tuple(result["joints"]), path.q, path.dt, designed.limits_deg
    )  # fmt: skip
    print(excitation_text(result["excitation"]))
    show_design(result)
    print(f"Picture of one period: {picture}")
    return {**result, "picture": str(picture)}


def show_design(result: dict[str, Any]) -> None:
    """Predicted left over of the worst joint against its target, by motion and time."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result['rig']}: predicted left over, N·m at each joint")
    table.add_column("motion")
    times = list(result["predicted_left_over_Nm"]["designed"])
    for t in times:
        table.add_column(f"after {t} s", justify="right")
    for name, predicted in result["predicted_left_over_Nm"].items():
        table.add_row(name, *(" ".join(f"{value:.2f}" for value in predicted[t]) for t in times))
    table.add_row("target", *(" ".join(f"{value:.2f}" for value in result["targets_Nm"]) for _ in times))
    Console().print(table)
