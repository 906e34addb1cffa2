"""A replay reads the ticks in pieces, and keeps of each piece its figures only."""

from pathlib import Path

import numpy as np
import pytest
from tests.peaks import largest_peak_bytes

from exograv.loop.replay.columns import ReplayedDecisions
from exograv.loop.replay.difference import WHAT, Comparison
from exograv.loop.replay.recorded_run import RecordedRun
from exograv.model.description import load_rig
from exograv.recording import open_recording, read_recording, stored_messages
from exograv.report.figures.replay_data import BINS, ReplaySeries
from memory import write_long

SHORT, LONG = 5_000, 60_000
OFF_NM = 0.25


def compared(path: Path) -> tuple[Comparison, ReplaySeries]:
    """Compare a recording with decisions that are `OFF_NM` above the recorded ones."""
    run = RecordedRun(open_recording(path), load_rig("recupera_like", "right"))
    joints, names = run.recording.joints, run.phase_names
    comparison = Comparison(joints, names)
    series = ReplaySeries(joints, names, (0, run.recording.tick_count), 1e-6)
    for columns in run.pieces():
        again = ReplayedDecisions.of(len(columns), len(joints))
        again.tau_desired, again.tau_commanded = (columns[name] + OFF_NM for name in WHAT)
        difference = comparison.add(columns, again)["tau_commanded"].by_tick
        series.add(
            columns.first, columns["t"], columns["phase"], (columns["tau_commanded"], again.tau_commanded, difference)
        )
    return comparison, series


def test_memory_of_a_comparison_grows_by_at_most_two_bytes_per_tick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(stored_messages, "IN_MEMORY_BYTES", 1000)
    paths = {ticks: tmp_path / f"{ticks}.mcap" for ticks in (SHORT, LONG)}
    for ticks, path in paths.items():
        write_long(path, ticks)
    compared(paths[SHORT])  # what is made once
    short, long = (largest_peak_bytes(lambda path=path: compared(path)) for path in paths.values())
    assert long - short < 2 * (LONG - SHORT)


def test_figures_of_pieces_are_those_of_the_whole_recording(tmp_path: Path):
    write_long(tmp_path / "a.mcap", LONG)
    ticks = read_recording(tmp_path / "a.mcap").ticks
    comparison, series = compared(tmp_path / "a.mcap")
    assert comparison.ticks == comparison.spreads["tau_commanded"].ticks == LONG
    assert [phase.ticks for phase in comparison.phases] == np.bincount(ticks["phase"])[1:].tolist()
    assert comparison.spreads["tau_desired"].difference.rms == [OFF_NM] * 4
    assert comparison.first is not None
    assert comparison.first.tick == 0
    starts = np.unique(np.linspace(0, LONG, BINS, endpoint=False).astype(int))
    np.testing.assert_array_equal(series.recorded.low, np.minimum.reduceat(ticks["tau_commanded"], starts))
    np.testing.assert_array_equal(series.recorded.high, np.maximum.reduceat(ticks["tau_commanded"], starts))
    ends = np.append(starts[1:], LONG) - 1
    np.testing.assert_array_equal(series.t, 0.5 * (ticks["t"][starts] + ticks["t"][ends]))
    assert series.rms == pytest.approx(np.full(4, OFF_NM))
