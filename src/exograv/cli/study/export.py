"""Command `exograv study export`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from exograv.study.bids.export import ExportResult


@dataclass(frozen=True)
class Export:
    """Options of `exograv study export`."""

    study: Annotated[Path, tyro.conf.Positional] = Path()
    """Folder of the study; by default the current folder."""

    bids: Path = field(default=tyro.MISSING)
    """Folder of the data set. An earlier export is replaced; a folder with other content is refused."""

    rate: float = 100.0
    """Rows of motion per second [Hz]."""

    raw: bool = True
    """Include the recordings in `sourcedata/`. They contain the wearer's height and mass as stated."""


def run_export(command: Export) -> "ExportResult":
    """Export a study as a BIDS data set, which programs of other laboratories read."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.study.bids.export import export_bids

    with bars(FIRST_LINE_S) as progress:
        progress("Reading the study", 0.0)
        result = export_bids(command.study, command.bids, command.rate, command.raw, progress)
    print(
        f"{result.dataset}: {result.sessions} sessions of {result.participants} participants, "
        f"{result.touches} touches, {result.motion_rows} rows of motion, {result.bytes / 1e6:.1f} MB in "
        f"{result.files} files."
    )
    for sentence in result.not_exported:
        print(sentence)
    print(f"{result.dataset / 'README.md'} describes the data set.")
    if command.raw:
        print(
            f"Before you share it: {result.dataset / 'sourcedata'} has the wearers' body data. --no-raw leaves it out."
        )
    return result
