"""`exograv rig-test`."""

from typing import Any

from exograv.cli.shell.base_options import Common
from exograv.live.options import RigTestOptions


def run_rig_test_command(options: RigTestOptions, common: Common) -> dict[str, Any]:
    """Bring an empty machine up on the bench, step by step in the order of danger; nothing can be skipped."""
    from exograv.cli.shell.terminal import bars, say
    from exograv.live.on_drives.bring_up_command import run_rig_test

    with bars() as progress:
        result = run_rig_test(options, common.out, progress, say)
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
