"""Campaign of process faults: fly each session, repeat flights that ended before the strike, and keep the verdicts."""

import importlib.util
import pickle
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
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

from .cell import Cell, Fault, Process
from .evidence import FlightEvidence, MachineFigures
from .figures import MatrixFigures, figures_of
from .flight import Ground, fly
from .gaps import TickGaps
from .judge import CellVerdict, judge
from .options import ProcessFaultOptions
from .participant import PreparedParticipant, drawn_seed, participant_file
from .sessions import sessions_of
from .table import expected_of, reason_absent

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
    sessions = sessions_of([cell for cell in cells if cell.name not in done])

    def keep(verdict: CellVerdict) -> None:
        rows.add(verdict)
        done[verdict.cell] = verdict
        progress(f"Flown: {verdict.cell}", len(done) / max(len(cells), 1))

    try:
        fly_sessions(campaign, sessions, ground, machine, folder / FLIGHTS, keep)
    except KeyboardInterrupt:
        progress("Stopped by Ctrl-C; the cells flown so far are summed up", 1.0)
    verdicts = [done[cell.name] for cell in cells if cell.name in done]
    absent = [] if campaign.only else absent_verdicts()
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


def fly_sessions(
    campaign: MatrixCampaign,
    sessions: Iterable[tuple[Cell, ...]],
    ground: Ground,
    machine: MachineFigures,
    folder: Path,
    keep: Callable[[CellVerdict], object],
) -> None:
    """Fly sessions, and judge each while the next one starts. `keep` is called with each verdict.

    A cell that was not struck, or is late beside bare loops, is flown again, in a session of its own, at most
    `campaign.tries` times in all.

    Raises:
        RigError: The simulated drives do not start.
        KeyboardInterrupt: Ctrl-C was pressed. The sessions before are judged.
    """
    waiting = deque((tuple(cells), 1) for cells in sessions)
    landed: Landed | None = None
    with ThreadPoolExecutor(1, "judge") as judges:
        while waiting or landed is not None:
            before, landed = landed, None
            try:
                if waiting:
                    landed = _flown(waiting.popleft(), ground, folder, judges)
            finally:
                if before is not None:
                    for verdict in _judged(before, machine):
                        if verdict.is_to_repeat and before.tries < campaign.tries:
                            waiting.append(((Cell.of(verdict.cell),), before.tries + 1))
                        else:
                            keep(verdict.settled())


@dataclass(frozen=True)
class Landed:
    """Session that has ended and is judged now."""

    cells: tuple[Cell, ...]
    tries: int
    evidence: "Future[list[FlightEvidence]]"


def _flown(order: tuple[tuple[Cell, ...], int], ground: Ground, folder: Path, judges: ThreadPoolExecutor) -> Landed:
    cells, tries = order
    if missing_library(cells):
        return Landed(cells, tries, judges.submit(list))
    place = folder / f"{cells[0].name.replace(':', '_')}_{tries}"
    return Landed(cells, tries, judges.submit(fly(cells, ground, place)))


def _judged(landed: Landed, machine: MachineFigures) -> Iterator[CellVerdict]:
    if why := missing_library(landed.cells):
        yield from (CellVerdict(cell.name, ABSENT_HERE, faults=(why,), tries=0) for cell in landed.cells)
        return
    for cell, evidence in zip(landed.cells, landed.evidence.result(), strict=True):
        yield replace(judge(cell, expected_of(cell), evidence, machine), tries=landed.tries)


ABSENT_HERE = "not in this session"
"""Status of a cell that cannot be flown."""


def missing_library(cells: Sequence[Cell]) -> str:
    """Return the reason why this computer cannot fly these cells; empty if it can."""
    for process, library, extra in ((Process.LSL, "pylsl", "lsl"), (Process.ROS2, "zenoh", "ros2")):
        if any(cell.process is process for cell in cells) and importlib.util.find_spec(library) is None:
            return f"{library} is not installed. Install exograv[{extra}]."
    return ""


def absent_verdicts() -> list[CellVerdict]:
    """Return the pairs of process and fault that make no sense, each with its reason."""
    return [
        CellVerdict(f"{process}:{fault}", ABSENT_HERE, faults=(why,), tries=0)
        for process in Process
        for fault in Fault
        if (why := reason_absent(process, fault))
    ]


def verdict_of(row: Mapping[str, Any]) -> CellVerdict:
    """Read a row of the checkpoint.

    Raises:
        KeyError, TypeError, ValueError: The row has another form.
    """
    return CellVerdict(**{**row, "faults": tuple(row["faults"]), "gaps": TickGaps(**row["gaps"])})
