"""A campaign repeats flights that ended before the strike, keeps each verdict, and is bad if one cell is not proved."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from tests.campaigns.process_faults.made_up_process_flights import MACHINE, STRUCK_S, Course, evidence_of

from exograv.campaigns.process_faults import campaign as module
from exograv.campaigns.process_faults.bare_loops import HostPause
from exograv.campaigns.process_faults.campaign import (
    ABSENT_HERE,
    MatrixCampaign,
    absent_verdicts,
    fly_sessions,
    run_matrix,
    verdict_of,
)
from exograv.campaigns.process_faults.cell import Cell
from exograv.campaigns.process_faults.evidence import FlightEvidence
from exograv.campaigns.process_faults.figures import figures_of
from exograv.campaigns.process_faults.flight import Ground
from exograv.campaigns.process_faults.judge import CellVerdict
from exograv.campaigns.process_faults.table import all_cells
from exograv.model.description import load_rig

CELL = Cell.of("control:kill:floating")
GROUND = Ground(Path("participant.pickle"), load_rig("recupera_like"), 2, 1000)
EARLY = replace(evidence_of(Course()), struck_t=None, stopped_before="the guard stopped the machine")
GOOD = evidence_of(Course(descends_s=0.004))


def fly_as(patch: pytest.MonkeyPatch, *flights: FlightEvidence) -> list[str]:
    """Let the campaign fly these flights; return the list that will hold the folder names of its sessions."""
    left, places = list(flights), list[str]()

    def fly(cells: Sequence[Cell], _ground: Ground, folder: Path) -> Callable[[], list[FlightEvidence]]:
        places.append(folder.name)
        flown = [left.pop(0) for _ in cells]
        return lambda: flown

    patch.setattr(module, "fly", fly)
    return places


def flown(campaign: MatrixCampaign, cells: Sequence[Cell]) -> list[CellVerdict]:
    verdicts = list[CellVerdict]()
    fly_sessions(campaign, [tuple(cells)], GROUND, MACHINE, campaign.out, verdicts.append)
    return verdicts


def test_a_flight_that_ended_before_the_strike_is_repeated(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    places = fly_as(monkeypatch, EARLY, GOOD)
    (verdict,) = flown(MatrixCampaign(out=tmp_path), [CELL])
    assert (verdict.status, verdict.tries) == ("as expected", 2)
    assert places == ["control_kill_floating_1", "control_kill_floating_2"]


def test_a_cell_that_never_was_struck_is_not_flown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    fly_as(monkeypatch, EARLY, EARLY, GOOD)
    (verdict,) = flown(MatrixCampaign(out=tmp_path, tries=2), [CELL])
    assert (verdict.status, verdict.tries) == ("not flown", 2)
    assert figures_of([verdict], [], 0, 2).is_bad


def test_a_late_cell_beside_bare_loops_is_repeated_and_then_judged(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    paused = evidence_of(Course(descends_s=0.025), host_pauses=(HostPause(STRUCK_S + 0.02, 0.018, 0),))
    places = fly_as(monkeypatch, paused, paused, GOOD)
    (verdict,) = flown(MatrixCampaign(out=tmp_path), [CELL])
    assert (verdict.status, verdict.tries, len(places)) == ("as expected", 3, 3)
    fly_as(monkeypatch, paused, paused)
    (verdict,) = flown(MatrixCampaign(out=tmp_path, tries=2), [CELL])
    assert verdict.status == "late"
    assert not verdict.is_bad(on_shared=True)


def test_cells_that_are_left_are_not_bad_on_a_shared_computer():
    assert [figures_of([], ["control:kill:floating"], 0, 2, shared).is_bad for shared in (False, True)] == [True, False]


def test_a_cell_that_an_earlier_strike_of_its_session_prevented_is_flown_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    cells = [Cell.of("worker:stop:moving"), Cell.of("recorder:stop:moving")]
    places = fly_as(monkeypatch, evidence_of(Course()), EARLY, evidence_of(Course()))
    verdicts = flown(MatrixCampaign(out=tmp_path), cells)
    assert [(one.cell, one.tries) for one in verdicts] == [("worker:stop:moving", 1), ("recorder:stop:moving", 2)]
    assert places == ["worker_stop_moving_1", "recorder_stop_moving_2"]


def test_a_resumed_campaign_flies_only_the_cells_without_a_verdict(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(module, "prepared_ground", lambda *_: (GROUND, MACHINE))
    names = ("control:kill:floating", "control:stop:floating")
    fly_as(monkeypatch, GOOD)
    first = run_matrix(MatrixCampaign(only=names[:1], out=tmp_path), lambda *_: None)
    assert (first.as_expected, first.is_bad) == (1, False)
    places = fly_as(monkeypatch, evidence_of(Course(descends_s=0.5)))
    both = run_matrix(MatrixCampaign(only=names, out=tmp_path, resume=True), lambda *_: None)
    assert places == ["control_stop_floating_1"]
    assert both.late == ["control:stop:floating"]
    assert both.is_bad
    text = (tmp_path / "process_faults.md").read_text(encoding="utf-8")
    assert all(name in text for name in names)


def test_the_full_matrix_is_complete_after_an_interruption_and_flies_no_cell_twice(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    monkeypatch.setattr(module, "prepared_ground", lambda *_: (GROUND, MACHINE))
    struck, sessions_left = list[Cell](), [60]

    def fly(cells: Sequence[Cell], _ground: Ground, _folder: Path) -> Callable[[], list[FlightEvidence]]:
        if not sessions_left[0]:
            raise KeyboardInterrupt
        sessions_left[0] -= 1
        struck.extend(cells)
        return lambda: [evidence_of(Course()) for _ in cells]

    monkeypatch.setattr(module, "fly", fly)
    monkeypatch.setattr(module, "missing_library", lambda _: "")
    first = run_matrix(MatrixCampaign(cells="all", out=tmp_path), lambda *_: None)
    assert first.is_bad
    assert sorted([*first.missing, *(cell.name for cell in struck)]) == sorted(cell.name for cell in all_cells())
    sessions_left[0] = 1000
    second = run_matrix(MatrixCampaign(cells="all", out=tmp_path, resume=True), lambda *_: None)
    assert second.missing == []
    assert sorted(cell.name for cell in struck) == sorted(cell.name for cell in all_cells())


def test_a_verdict_is_the_same_after_the_checkpoint():
    verdict = CellVerdict("control:spin:floating", "not as expected", faults=("one", "two"), exit_code=1)
    assert verdict_of(asdict(verdict)) == verdict


def test_a_cell_whose_library_is_not_installed_is_not_flown_and_not_bad(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    fly_as(monkeypatch)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    (verdict,) = flown(MatrixCampaign(out=tmp_path), [Cell.of("lsl:kill:floating")])
    assert verdict.status == ABSENT_HERE
    assert "exograv[lsl]" in verdict.faults[0]
    assert not figures_of([verdict], [], 0, 2).is_bad


def test_pairs_that_make_no_sense_are_listed_with_their_reason_and_are_not_bad():
    verdicts = absent_verdicts()
    assert all(verdict.faults[0] for verdict in verdicts)
    assert "session:kill" in {verdict.cell for verdict in verdicts}
    assert not figures_of(verdicts, [], 0, 2).is_bad
