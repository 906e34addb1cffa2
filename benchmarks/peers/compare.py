"""Comparison of a run with an earlier one: changes that are larger than the noise."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from exograv.errors import RecordingError

from .ratios import advantage
from .table import figure

GIVE = "Give a file that benchmarks/kernels.py --save has written."

NOTEWORTHY = 0.10
"""Relative change of a median below which the change is noise, because the computer does other work too."""


def read_run(path: Path) -> dict[str, Any]:
    """Read a run that `--save` or `--json` has written.

    Raises:
        RecordingError: The file cannot be read, or holds no run.
    """
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}. {GIVE}") from error
    except ValueError as error:
        raise RecordingError(f"{path} is not valid JSON: {error}. {GIVE}") from error
    rows = result.get("rows") if isinstance(result, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) and "p50" in row for row in rows):
        raise RecordingError(f"{path} holds no rows of a run. {GIVE}")
    return result


def changes(before: dict[str, Any], after: dict[str, Any]) -> list[tuple[dict[str, Any], dict[str, Any], float]]:
    """Return the rows of both runs, and the speed ratio of the second to the first."""
    earlier = {(row["name"], row["implementation"]): row for row in before["rows"]}
    pairs = [(earlier.get((row["name"], row["implementation"])), row) for row in after["rows"]]
    return [(old, new, advantage(new, old)) for old, new in pairs if old is not None and old["unit"] == new["unit"]]


def show_changes(before: dict[str, Any], after: dict[str, Any], name: str) -> None:
    """Print a table of noteworthy changes, and one line about the rest."""
    console, found = Console(), changes(before, after)
    table = Table(title=f"Against {name}: medians that changed by more than {100 * NOTEWORTHY:.0f} %")
    for heading in ("row", "implementation", "before", "now", "times faster"):
        table.add_column(heading, justify="left" if heading in ("row", "implementation") else "right")
    noteworthy = [entry for entry in found if abs(entry[2] - 1.0) > NOTEWORTHY]
    for old, new, times in noteworthy:
        table.add_row(new["name"], new["implementation"], figure(old, "p50"), figure(new, "p50"), f"{times:.2f}")
    if noteworthy:
        console.print(table)
    console.print(f"{len(found)} rows are in both runs; {len(noteworthy)} of them changed.", highlight=False)
    if before.get("machine", {}).get("cpu") != after["machine"]["cpu"]:
        console.print("The earlier run was made on another computer: compare only ratios.", highlight=False)
