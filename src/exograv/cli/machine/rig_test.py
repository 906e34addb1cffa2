"""`exograv rig-test`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class RigTest(Common):
    """Bring an empty machine up on the bench, step by step in the order of danger; nothing can be skipped."""

    rig: tyro.conf.Positional[str] = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    drives: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """drives.toml: how the motors of this machine are wired (docs/rig_test.md)."""

    simulate: bool = False
    """Practise on simulated drives in another process, with hands that are simulated too."""

    level: int = 2
    """Disturbances of the simulated machine: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    by: Annotated[str, tyro.conf.arg(metavar="INITIALS")] = ""
    """Who does it, for the sheet."""

    wrong_sign: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")] = ()
    """With --simulate: joints whose motor turns the other way."""

    wrong_scale: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT:FACTOR")] = ()
    """With --simulate: joints whose motor gives so many times the torque."""

    wrong_encoder: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")] = ()
    """With --simulate: joints whose encoder counts the other way."""


def run_rig_test_command(command: RigTest) -> dict[str, Any]:
    """Run it and print the sheet."""
    from rich.console import Console

    from exograv.cli.shell.terminal import bars
    from exograv.live.on_drives.bring_up_command import RigTestOptions, run_rig_test

    wrong: list[str] = []
    for option in ("wrong_sign", "wrong_scale", "wrong_encoder"):
        if values := getattr(command, option):
            wrong += [f"--{option.replace('_', '-')}", *values]
    options = RigTestOptions(
        command.rig, command.side, command.drives, command.simulate, command.level, command.seed, command.by,
        tuple(wrong),
    )  # fmt: skip
    console = Console()
    with bars() as progress:
        result = run_rig_test(options, command.out, progress, lambda text: console.print(text, highlight=False))
    show_rig_test(result)
    return result


def show_rig_test(result: dict[str, Any]) -> None:
    """One row a step, room for a signature, and what to do below."""
    from rich.console import Console
    from rich.table import Table

    simulated = ", simulated" if result["simulated"] else ""
    table = Table(title=f"Bring-up of {result['rig']}, serial {result['serial']}{simulated}")
    table.add_column("step")
    table.add_column("measured", justify="right")
    table.add_column("limit", justify="right")
    table.add_column("")
    for step in result["steps"]:
        mark = {True: "ok", False: "FAILED", None: "not tried"}[step["passed"]]
        limit = f"{_cell(step['limit'])} {step['unit']}".strip()
        table.add_row(step["name"].replace("_", " "), _cell(step["value"]), limit, mark)
    console = Console()
    console.print(table)
    for step in result["steps"]:
        if step["what_to_do"]:
            console.print(f"{step['name']}: {step['what_to_do']}", highlight=False)
    verdict = "The machine has passed." if result["passed"] else "The machine has not passed: mend that, and repeat."
    console.print(f"{verdict} Done by: {result['by'] or '–'}    Signature: ______________________", highlight=False)
    console.print(f"{result['sheet']} (sealed {result['sha256'][:12]}…)", highlight=False, soft_wrap=True)


def _cell(value: float | str | None) -> str:
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)
