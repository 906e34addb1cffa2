"""`exograv self-test`."""

from typing import Any

from exograv.cli.shell.base_options import Common, refuse_unwritable
from exograv.procedures.self_test.options import SelfTestOptions


def run_self_test_command(options: SelfTestOptions, common: Common) -> dict[str, Any]:
    """Test the empty machine and this computer before anybody is in it: each day, and after every stop by a fault."""
    from exograv.cli.shell.terminal import bars, say

    from .rig_factory import run_self_test

    refuse_unwritable(common.out / "self_test.mcap", "--out")
    with bars() as progress:
        result = run_self_test(options, common.out, progress, say)
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
