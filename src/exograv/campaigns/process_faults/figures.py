"""Figures of the matrix: verdicts by cell, and the gaps between ticks beside a spinning process; Markdown and JSON."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from exograv.files import replace_file
from exograv.results import json_value

from .cell import Fault
from .gaps import TickGaps, pooled
from .judge import CellVerdict

MARKDOWN, JSON = "process_faults.md", "process_faults.json"

HEAD = ("cell", "result", "seen", "reaction ms", "budget ms", "worst gap ms", "exit", "end s", "tries", "remarks")


@dataclass(frozen=True)
class MatrixFigures:
    """Result of a campaign of process faults."""

    flown: int
    """Number of cells that were struck and judged."""
    as_expected: int
    late: list[str]
    """Cells with a reaction after its budget, or with a descent that a pause of the computer explains."""
    not_as_expected: list[str]
    not_flown: list[str]
    """Cells whose session always ended before the strike. They prove nothing."""
    missing: list[str]
    """Cells that an interrupted campaign has not reached."""
    spinning: TickGaps
    """Gaps between two ticks of the guard while another process spins."""
    seed: int
    level: int
    on_shared: bool
    """True if a pause of the computer makes no cell bad."""
    cells: list[CellVerdict]

    @property
    def is_bad(self) -> bool:
        """True if a cell is bad, or is missing and the computer is not shared."""
        return (bool(self.missing) and not self.on_shared) or any(one.is_bad(self.on_shared) for one in self.cells)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Rows of the table, as texts below `HEAD`."""
        return [_row(verdict) for verdict in self.cells]

    def write(self, folder: Path) -> None:
        """Write the table as Markdown and as JSON."""
        replace_file(folder / MARKDOWN, self.markdown())
        replace_file(folder / JSON, json.dumps(json_value(self), indent=1, ensure_ascii=False) + "\n")

    def markdown(self) -> str:
        """Return the table and its summary as Markdown."""
        lines = [HEAD, ("---",) * len(HEAD), *self.rows]
        table = "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)
        return f"# Process faults\n\n{self.summary()}\n\n{table}\n"

    def summary(self) -> str:
        """Return the counts and the gaps beside a spinning process."""
        said = (
            f"{self.flown} cells flown: {self.as_expected} as expected, {len(self.late)} late, "
            f"{len(self.not_as_expected)} not as expected. "
            f"{len(self.not_flown)} sessions ended before the strike, {len(self.missing)} cells are left."
        )
        gaps = self.spinning
        if gaps.worst_ms is None:
            return said
        return (
            f"{said} Gap between two ticks of the guard while another process spins: {gaps.p50_ms:g} ms (median), "
            f"{gaps.p99_ms:g} (p99), {gaps.worst_ms:g} (worst)."
        )


def figures_of(
    verdicts: Sequence[CellVerdict], missing: Sequence[str], seed: int, level: int, on_shared: bool = False
) -> MatrixFigures:
    """Return the figures of a campaign; `missing` are the cells without a verdict."""
    by_status = {
        status: [one.cell for one in verdicts if one.status == status]
        for status in ("as expected", "late", "not as expected", "not flown")
    }
    good, late, bad, not_flown = by_status.values()
    # A supervisor of the guard that spins shares the guard's process; it is no neighbour.
    spin = [one.gaps for one in verdicts if f":{Fault.SPIN}:" in one.cell and not one.cell.startswith("guard")]
    spinning = replace(pooled(spin), histogram={})
    return MatrixFigures(
        len(good) + len(late) + len(bad),
        len(good),
        late,
        bad,
        not_flown,
        list(missing),
        spinning,
        seed,
        level,
        on_shared,
        list(verdicts),
    )


def _row(one: CellVerdict) -> tuple[str, ...]:
    numbers = (one.reaction_ms, one.budget_ms, one.gaps.worst_ms, one.exit_code, one.ended_s)
    told = ["–" if number is None else f"{number:g}" for number in numbers]
    return one.cell, one.status, one.seen or "–", *told, str(one.tries), "; ".join(one.faults)
