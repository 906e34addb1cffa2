"""Options of the matrix of process faults."""

import sys
from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from exograv.errors import ConfigError
from exograv.options import Level, Options, Repeated, Seed, Within

from .cell import Cell
from .table import all_cells, covering_cells, python_cells


@dataclass(frozen=True)
class ProcessFaultOptions(Options):
    """Options of `exograv dev process-faults`."""

    cells: Literal["covering", "python", "all"] = "covering"
    """Cells to fly: each process with each fault once, in rotated states; the same in the loop in Python, for the
    processes that this loop meets; or all states and both loops."""

    only: Annotated[Repeated, tyro.conf.arg(metavar="PROCESS:FAULT:STATE")] = ()
    """Cells to fly in place of `--cells`, such as control:kill:floating. Can be repeated."""

    seed: Seed = 0
    level: Level = 2

    tries: Annotated[int, Within(1, 10)] = 3
    """Largest number of flights of a cell whose session ended before the strike, or that a pause made late."""

    shared: bool = False
    """Others use this computer, too: a late reaction in a pause of the computer, a session that ended before its
    strike, and cells that are left do not fail."""

    resume: bool = False
    """Continue an interrupted campaign with the verdicts in the folder of `--out`."""

    def __post_init__(self):
        super().__post_init__()
        if not sys.platform.startswith("linux"):
            raise ConfigError(f"exograv dev process-faults needs Linux, and this is {sys.platform}.")
        if len(set(self.only)) < len(self.only):
            raise ConfigError("--only names a cell twice. Name each cell once.")
        _ = self.chosen  # An unknown cell is refused before the participant is prepared.

    @property
    def chosen(self) -> list[Cell]:
        """Cells of `--only`, in the order of the options.

        Raises:
            ConfigError: A cell does not exist.
        """
        return [Cell.of(name) for name in self.only]

    @property
    def planned(self) -> list[Cell]:
        """Cells of this campaign, in the order of the flights."""
        if self.only:
            return self.chosen
        return {"covering": covering_cells, "python": python_cells, "all": all_cells}[self.cells]()
