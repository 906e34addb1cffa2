"""Replay of a recording, with the ticks in which control or guard decide differently."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.live.replay import LiveReplay
from exograv.loop.pilot import Progress
from exograv.loop.replay.columns import Columns, ReplayedDecisions
from exograv.loop.replay.difference import (
    RESOLUTION_NM,
    Difference,
    FirstDifference,
    PhaseDifference,
    TorqueDifference,
    by_phase,
    differences,
    first_difference,
    recorded_stops,
)
from exograv.loop.replay.lockstep_replay import Lockstep
from exograv.loop.replay.options import InsteadOptions
from exograv.loop.replay.reasons import circumstances
from exograv.loop.replay.recorded_run import RecordedRun, recorded
from exograv.loop.replay.what_if import AS_RECORDED, ReplayOverrides
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
        again = again_of(run, instead, progress)
        columns = Columns(run.recording.ticks)
        found = differences(columns, again)
        result = figures(run, columns, again, found, instead)
        figure = None if folder is None else _draw(run, columns, again, found, folder)
    return ReplayResult(result, figure, round(time.perf_counter() - start, 2))


def again_of(run: RecordedRun, instead: ReplayOverrides, progress: Progress) -> ReplayedDecisions:
    """Return the decisions of control and guard in the replay."""
    flight = Lockstep(run, instead) if run.live is None else LiveReplay(run, instead)
    return flight.fly(progress)


def figures(
    run: RecordedRun,
    columns: Columns,
    again: ReplayedDecisions,
    found: Mapping[str, Difference],
    instead: ReplayOverrides,
) -> ReplayFigures:
    """Return the figures of the comparison of replay and recording."""
    settings, everywhere = run.recording.settings, np.ones(len(columns), bool)
    first = first_difference(columns, run.recording.joints, found)
    others = np.flatnonzero((np.array(columns.safe_state) != again.safe_state) & again.knows_guard)
    is_identical = all(one.is_identical for one in found.values())
    # On another processor, torques and states may differ by rounding.
    same = first is None and not len(others) and not (is_identical and again.guard_differs)
    return ReplayFigures(
        ok=same or instead.is_anything,
        recording=run.recording.path,
        remark=run.recording.remark,
        rig=settings.get("rig"),
        command=settings.get("command"),
        world=settings.get("world"),
        joints=run.recording.joints,
        ticks=len(columns),
        compared={name: int(np.isfinite(one.by_tick).all(axis=1).sum()) for name, one in found.items()},
        given=int((~again.is_rebuilt).sum()),
        resolution_Nm=RESOLUTION_NM,
        bit_identical={name: one.is_identical for name, one in found.items()},
        first_difference=first,
        difference_Nm={name: one.of(everywhere) for name, one in found.items()},
        phases=by_phase(columns, run.phase_names, found),
        safe_state_differs=SafeStateDifference(len(others), round(columns.t[others[0]], 6) if len(others) else None),
        guard_states=GuardStates(again.guard_equal, [round(t, 6) for t in again.guard_differs], again.guard_restored),
        stops=ReplayedStops(recorded_stops(columns), [ReplayedStop(round(t, 6), cause) for t, cause in again.stops]),
        gaps=[RecordingGap(round(t, 6), lost) for t, lost in again.gaps],
        instead=instead,
        circumstances=circumstances(run, again, instead),
    )


def _draw(
    run: RecordedRun, columns: Columns, again: ReplayedDecisions, found: Mapping[str, Difference], folder: Path
) -> Path:
    from exograv.report.figures.replay import Series, draw  # Matplotlib: 0.4 s
    from exograv.report.style.figure_style import mark_simulated, write_picture

    # The figure begins with the arm in the machine: minutes of an empty machine would leave it no room.
    worn = slice(int(np.isfinite(columns["gravity_level"]).argmax()), None)
    names, phase, t = run.phase_names, columns["phase"][worn], columns["t"][worn]
    begins = np.flatnonzero(np.diff(phase.astype(int), prepend=-1))
    series = Series(
        t=t,
        recorded=columns["tau_commanded"][worn],
        again=again.tau_commanded[worn],
        difference=found["tau_commanded"].by_tick[worn],
        joints=run.recording.joints,
        phases=[(t[k], names[phase[k]]) for k in begins],
        gaps=[t for t, _ in again.gaps],
        resolution=RESOLUTION_NM,
    )
    simulated = run.recording.is_simulated
    return write_picture(
        folder / f"{run.recording.path.stem}_replay.png", lambda: mark_simulated(draw(series), simulated)
    )
