"""`exograv study export`."""

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
    """Folder of the study; the one you are in if absent."""

    bids: Path = field(default=tyro.MISSING)
    """Folder of the data set. An earlier export there is replaced; anything else is refused."""

    rate: float = 100.0
    """Rows a second of the motion [Hz]."""

    raw: bool = True
    """Give the recordings along, in `sourcedata/`; they hold the wearer's height and mass as they were told."""


def run_export(command: Export) -> "ExportResult":
    """Give a study on as a data set of BIDS, which other laboratories' programs read."""
    from exograv.study.bids.export import export_bids

    result = export_bids(command.study, command.bids, command.rate, command.raw)
    print(
        f"{result.dataset}: {result.sessions} sessions of {result.participants} participants, "
        f"{result.touches} touches, {result.motion_rows} rows of motion, {result.bytes / 1e6:.1f} MB in "
        f"{result.files} files."
    )
    for sentence in result.not_exported:
        print(sentence)
    return result
