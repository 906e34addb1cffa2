"""Command `exograv dev validate-participant` and the table of its result."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.options import NamedNumbers, SeedOption
from exograv.results import MERGED

if TYPE_CHECKING:
    from exograv.campaigns.virtual_study.validation import ValidationResult


@dataclass(frozen=True)
class ValidationOptions:
    """Virtual people to compare with published data."""

    people: int = 6
    """Number of virtual people, drawn from `seed` and the following seeds; about 15 s each."""

    constants: NamedNumbers = field(default_factory=dict)
    """Constants of the virtual participant as NAME=VALUE, such as sees_higher_m=0.05."""


@dataclass(frozen=True)
class ValidationShown:
    """Result of `exograv dev validate-participant`."""

    found: "ValidationResult" = field(metadata=MERGED)
    picture: Path


def run_validate_participant(options: ValidationOptions, drawn: SeedOption, common: OutFolder) -> ValidationShown:
    """Compare the virtual participant with published data, before conclusions are drawn from simulations."""
    from exograv.campaigns.virtual_study.validation import run_validation
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.participant.habits import with_constants
    from exograv.report.figures.participant_validation import draw
    from exograv.report.style.figure_style import write_picture

    habits = with_constants(options.constants)
    path = common.out / "participant_validation.png"
    refuse_unwritable(path, "--out")
    with bars() as progress:
        result = run_validation(options.people, drawn.seed, progress, habits)
    _show(result)
    up_mm = {
        level: [[touch.up_mm for touch in windows[0]] for windows in people] for level, people in result.touches.items()
    }
    picture = write_picture(path, lambda: draw(up_mm))
    print(f"Picture: {picture}")
    return ValidationShown(result, picture)


def _show(result: "ValidationResult") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"Virtual participant, simulated, {result.people} people: no evidence about people")
    for column in ("", "published", "ours, 95 % over people", "verdict", "why"):
        table.add_column(column)
    for row in result.rows:
        unit = "" if row.unit == "-" else f" {row.unit}"
        ours = (
            ""
            if row.ours is None or row.interval is None
            else "{:.3g} ({:.3g} to {:.3g}){}".format(row.ours, *row.interval, unit)
        )
        published = f"{row.published}{unit if row.published[0].isdigit() else ''}, {row.source}"
        published += " (unverified)" if row.standing == "unverified" else ""
        table.add_row(row.what, published, ours, row.verdict, row.why)
    Console().print(table)
