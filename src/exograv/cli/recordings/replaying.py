"""Replay of a recording, with the ticks in which control or guard decide differently."""

import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.live.replay import LiveReplay
from exograv.loop.pilot import Progress
from exograv.loop.replay.columns import ReplayedDecisions
from exograv.loop.replay.difference import (
    RESOLUTION_NM,
    Comparison,
    FirstDifference,
    PhaseDifference,
    TorqueDifference,
)
from exograv.loop.replay.lockstep_replay import Lockstep
from exograv.loop.replay.options import InsteadOptions
from exograv.loop.replay.reasons import circumstances
from exograv.loop.replay.recorded_run import RecordedRun, recorded
from exograv.loop.replay.what_if import AS_RECORDED, ReplayOverrides
from exograv.recording import Recording
from exograv.report.figures.replay_data import ReplaySeries
from exograv.results import MERGED


@dataclass(frozen=True)
class SafeStateDifference:
    """Ticks with another safe state of the guard."""

    ticks: int
    first_s: float | None


@dataclass(frozen=True)
class GuardStates:
    """States of the guard in the recording, compared with those in the replay."""

    equal: int
    differ_s: list[float]
    """Times of those that differ."""
    continued: int
    """States with which the replay went on after a gap."""


@dataclass(frozen=True)
class ReplayedStop:
    """Stop of the guard in the replay."""

    t: float
    cause: str


@dataclass(frozen=True)
class ReplayedStops:
    """Stops of the guard in the run and in the replay."""

    recorded_s: list[float]
    replayed: list[ReplayedStop]


@dataclass(frozen=True)
class RecordingGap:
    """Ticks before this time that the recording has lost."""

    t: float
    lost: int


@dataclass(frozen=True)
class ReplayFigures:
    """Comparison of the decisions of control and guard in the replay with those in the recording."""

    ok: bool
    recording: Path
    remark: str | None
    rig: str | None
    command: str | None
    world: str | None
    """World of the twin; None for a real machine, and for recordings from before worlds."""
    joints: tuple[str, ...]
    ticks: int
    compared: dict[str, int]
    """Ticks that are compared, by kind of torque."""
    given: int
    """Ticks in which control's torque was taken from the recording."""
    resolution_Nm: float
    bit_identical: dict[str, bool]
    first_difference: FirstDifference | None
    difference_Nm: dict[str, TorqueDifference]
    phases: list[PhaseDifference]
    safe_state_differs: SafeStateDifference
    guard_states: GuardStates
    stops: ReplayedStops
    gaps: list[RecordingGap]
    instead: InsteadOptions
    circumstances: list[str]


@dataclass(frozen=True)
class ReplayResult:
    """Result of `exograv data replay`."""

    figures: ReplayFigures = field(metadata=MERGED)
    figure: Path | None
    wall_s: float


def run_replay(
    file: Path, folder: Path | None, progress: Progress, instead: ReplayOverrides = AS_RECORDED
) -> ReplayResult:
    """Replay a recording and compare the decisions.

    Args:
        file: Recording.
        folder: Folder of the figure; None draws no figure.
        progress: Function that shows the progress.
        instead: Replacements for recorded values.

    Raises:
        RecordingError: The file cannot be replayed, or the figure cannot be written.
        ConfigError: A replacement cannot be used.
    """
    start = time.perf_counter()
    progress("Reading the recording", 0.0)
    with recorded(file, instead.rig) as run:
        progress("Reading the recording", 1.0)
        again, compared, series = _flown(run, instead, progress, is_drawn=folder is not None)
        result = figures(run, again, compared, instead)
        figure = None if folder is None or series is None else _draw(run, series, folder)
    return ReplayResult(result, figure, round(time.perf_counter() - start, 2))


def _flown(
    run: RecordedRun, instead: ReplayOverrides, progress: Progress, *, is_drawn: bool
) -> tuple[ReplayedDecisions, Comparison, ReplaySeries | None]:
    """Return the findings of the replay, its comparison with the recording, and the curves of the figure."""
    flight = Lockstep(run, instead) if run.live is None else LiveReplay(run, instead)
    recording, names = run.recording, run.phase_names
    compared, again = Comparison(recording.joints, names), ReplayedDecisions.of(0, len(recording.joints))
    ticks = (_first_worn(recording), recording.tick_count) if is_drawn else (0, 0)
    series = ReplaySeries(recording.joints, names, ticks, RESOLUTION_NM) if is_drawn else None
    for columns, again in flight.fly(progress):
        difference = compared.add(columns, again)["tau_commanded"].by_tick
        if series is not None:
            torques = columns["tau_commanded"], again.tau_commanded, difference
            series.add(columns.first, columns["t"], columns["phase"], torques)
    if series is not None:
        series.gaps = [t for t, _ in again.gaps]
    return again, compared, series


def _first_worn(recording: Recording) -> int:
    """Return the first tick with an arm in the machine; 0 without one.

    The figure begins there: minutes of an empty machine would leave the arm no room.
    """
    first = 0
    for ticks in recording.pieces(("gravity_level",)):
        worn = np.flatnonzero(np.isfinite(ticks["gravity_level"]))
        if len(worn):
            return first + int(worn[0])
        first += len(ticks)
    return 0


def figures(
    run: RecordedRun, again: ReplayedDecisions, compared: Comparison, instead: ReplayOverrides
) -> ReplayFigures:
    """Return the figures of the comparison of replay and recording."""
    settings = run.recording.settings
    # On another processor, torques and states may differ by rounding.
    is_identical = all(compared.is_identical.values())
    same = compared.first is None and not compared.other_states and not (is_identical and again.guard_differs)
    return ReplayFigures(
        ok=same or instead.is_anything,
        recording=run.recording.path,
        remark=run.recording.remark,
        rig=settings.get("rig"),
        command=settings.get("command"),
        world=settings.get("world"),
        joints=run.recording.joints,
        ticks=compared.ticks,
        compared={name: spread.ticks for name, spread in compared.spreads.items()},
        given=compared.given,
        resolution_Nm=RESOLUTION_NM,
        bit_identical=compared.is_identical,
        first_difference=compared.first,
        difference_Nm={name: spread.difference for name, spread in compared.spreads.items()},
        phases=compared.phases,
        safe_state_differs=SafeStateDifference(compared.other_states, compared.first_other_state_s),
        guard_states=GuardStates(again.guard_equal, [round(t, 6) for t in again.guard_differs], again.guard_restored),
        stops=ReplayedStops(compared.recorded_stops_s, [ReplayedStop(round(t, 6), cause) for t, cause in again.stops]),
        gaps=[RecordingGap(round(t, 6), lost) for t, lost in again.gaps],
        instead=instead,
        circumstances=circumstances(run, again, instead),
    )


def _draw(run: RecordedRun, series: ReplaySeries, folder: Path) -> Path:
    from exograv.report.figures.replay import draw  # Matplotlib: 0.4 s
    from exograv.report.style.figure_style import mark_simulated, write_picture

    simulated = run.recording.is_simulated
    return write_picture(
        folder / f"{run.recording.path.stem}_replay.png", lambda: mark_simulated(draw(series), simulated)
    )
