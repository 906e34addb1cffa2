"""Campaign of process faults: fly each cell, repeat flights that ended before the strike, and keep the verdicts."""

import pickle
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from exograv import __version__
from exograv.errors import ConfigError
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Progress
from exograv.recording.code import code_sha256
from exograv.runtime.clock.timing import PERIOD_NS
from exograv.storage.checkpoint import CheckpointRows

from .cell import Cell, Fault, State
from .evidence import MachineFigures
from .figures import MatrixFigures, figures_of
from .flight import Ground, fly
from .gaps import TickGaps
from .judge import CellVerdict, judge
from .options import ProcessFaultOptions
from .participant import PreparedParticipant, drawn_seed, participant_file
from .table import ABSENT, EXPECTED, reason_absent

FILE, FLIGHTS = "process_faults.jsonl", "flights"


@dataclass(frozen=True)
class MatrixCampaign(ProcessFaultOptions):
    """Cells of `exograv dev process-faults`, and the folder that keeps their verdicts."""

    out: Path = Path("out")
    """Folder of verdicts, results and flights."""

    @property
    def identity(self) -> dict[str, object]:
        """Settings that, with the code, determine the flight of a cell."""
        return {"exograv": __version__, "code": code_sha256(), "seed": self.seed, "level": self.level}


def run_matrix(campaign: MatrixCampaign, progress: Progress) -> MatrixFigures:
    """Fly all cells that have no verdict yet.

    Ctrl-C ends the campaign with the verdicts so far.

    Raises:
        ConfigError: The computer does not run Linux.
        ExogravError: The participant could not be prepared, or the simulated drives do not start.
    """
    if not sys.platform.startswith("linux"):
        raise ConfigError(f"exograv dev process-faults needs the signals of Linux, and this is {sys.platform}.")
    folder = campaign.out.resolve()
    rows = CheckpointRows(folder / FILE, campaign.identity, campaign.resume, asdict, verdict_of)
    done = {verdict.cell: verdict for verdict in rows.rows}
    ground, machine = prepared_ground(campaign, progress)
    cells = campaign.planned
    try:
        for number, cell in enumerate(cells):
            progress(f"Flying {cell.name}", number / len(cells))
            if cell.name not in done:
                verdict = flown_cell(campaign, cell, ground, machine, folder / FLIGHTS)
                rows.add(verdict)
                done[cell.name] = verdict
    except KeyboardInterrupt:
        progress("Stopped by Ctrl-C; the cells flown so far are summed up", 1.0)
    verdicts = [done[cell.name] for cell in cells if cell.name in done]
    absent = [] if campaign.only else [absent_verdict(Cell(one, Fault.KILL, State.FLOATING)) for one in ABSENT]
    missing = [cell.name for cell in cells if cell.name not in done]
    figures = figures_of([*verdicts, *absent], missing, campaign.seed, campaign.level, campaign.shared)
    figures.write(folder)
    return figures


def prepared_ground(campaign: MatrixCampaign, progress: Progress) -> tuple[Ground, MachineFigures]:
    """Prepare the participant, or take the prepared one of a resumed campaign.

    Raises:
        ExogravError: The participant could not be prepared.
    """
    path = participant_file(campaign.out.resolve(), campaign.seed, campaign.level, progress, campaign.resume)
    known: PreparedParticipant = pickle.loads(path.read_bytes())
    most = limits(known.description)
    machine = MachineFigures(
        known.prepared.machine.actuators.gain, most.torque_max_Nm, most.torque_rate_max_Nm_per_s,
        most.damping_Nms_per_rad, most.descent_s, 1e-9 * PERIOD_NS,
    )  # fmt: skip
    return Ground(path, known.description, campaign.level, drawn_seed(campaign.seed)), machine


def flown_cell(
    campaign: MatrixCampaign, cell: Cell, ground: Ground, machine: MachineFigures, folder: Path
) -> CellVerdict:
    """Fly a cell until its session is struck, at most `campaign.tries` times, and judge the last flight."""
    if reason_absent(cell):
        return absent_verdict(cell)
    expected = EXPECTED[cell.process, cell.fault]
    verdict = CellVerdict(cell.name, "not flown")
    for tries in range(1, campaign.tries + 1):
        place = folder / f"{cell.name.replace(':', '_')}_{tries}"
        verdict = replace(judge(cell, expected, fly(cell, expected, ground, place), machine), tries=tries)
        if verdict.status != "not flown":
            break
    return verdict


def absent_verdict(cell: Cell) -> CellVerdict:
    """Return the verdict on a cell that cannot be flown, with the reason."""
    name = cell.name if cell.process not in ABSENT else str(cell.process)
    return CellVerdict(name, "not in this session", faults=(reason_absent(cell),), tries=0)


def verdict_of(row: Mapping[str, Any]) -> CellVerdict:
    """Read a row of the checkpoint.

    Raises:
        KeyError, TypeError, ValueError: The row has another form.
    """
    return CellVerdict(**{**row, "faults": tuple(row["faults"]), "gaps": TickGaps(**row["gaps"])})
