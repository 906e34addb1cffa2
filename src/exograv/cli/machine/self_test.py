"""`exograv self-test`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common, refuse_unwritable


@dataclass(frozen=True)
class SelfTest(Common):
    """Test the empty machine and this computer before anybody is in it: each day, and after every stop by a fault."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); calibration.toml in the folder of --out if none is
    named."""

    worn: bool = False
    """Then also weigh the arm in the machine against the form."""

    body_mass: Annotated[float | None, tyro.conf.arg(metavar="KG")] = None
    """With --worn: body mass as the operator typed it [kg]; the wearer's own if none is given."""

    drives: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """drives.toml of a real machine, empty and hanging (docs/rig_test.md)."""

    simulate: bool = False
    """Practise on simulated drives in another process."""


def run_self_test_command(command: SelfTest) -> dict[str, Any]:
    """Run it and show every step."""
    from rich.console import Console

    from exograv.cli.shell.terminal import bars
    from exograv.procedures.self_test.self_test_command import SelfTestOptions

    from .rig_factory import run_self_test

    calibration = command.calibration or command.out / "calibration.toml"
    options = SelfTestOptions(
        command.rig, command.side, command.level, command.seed, calibration, command.worn, command.body_mass,
        command.drives, command.simulate,
    )  # fmt: skip
    console = Console()
    refuse_unwritable(command.out / "self_test.mcap", "--out")
    with bars() as progress:
        result = run_self_test(options, command.out, progress, lambda text: console.print(text, highlight=False))
    show_self_test(result)
    return result


def show_self_test(result: dict[str, Any]) -> None:
    """One row a step; what to do below."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"Self-test of {result['rig']}, {result['machine_s']:.0f} s of the machine")
    # A narrow terminal breaks words rather than cutting figures off.
    for heading in ("step", "measured", "limit", ""):
        is_figure = heading in ("measured", "limit")
        table.add_column(heading, justify="right" if is_figure else "left", overflow="fold")
    for step in result["steps"]:
        mark = {True: "ok", False: "FAILED", None: "not tried"}[step["passed"]]
        cells = (_cell(step["measured"]), f"{_cell(step['limit'])} {step['unit']}".strip())
        table.add_row(step["name"], *cells, mark)
    console = Console()
    console.print(table)
    for step in result["steps"]:
        if step["what_to_do"]:
            console.print(f"{step['name']}: {step['what_to_do']}", highlight=False)
    verdict = "The machine has passed." if result["ok"] else "The machine is refused."
    if result["ok"] and not result["may_be_worn"]:
        verdict += " Nobody may be in it: this computer is not punctual enough."
    console.print(f"{verdict} Lock: {result['self_test']}.", highlight=False)


def _cell(value: float | str | None) -> str:
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)
