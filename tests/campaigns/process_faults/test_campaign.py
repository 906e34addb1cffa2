"""A campaign repeats flights that ended before the strike, keeps each verdict, and is bad if one cell is not proved."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
from tests.campaigns.process_faults.made_up_process_flights import MACHINE, Course, evidence_of

from exograv.campaigns.process_faults import campaign as module
from exograv.campaigns.process_faults.campaign import MatrixCampaign, flown_cell, run_matrix, verdict_of
from exograv.campaigns.process_faults.cell import Cell
from exograv.campaigns.process_faults.evidence import FlightEvidence
from exograv.campaigns.process_faults.figures import figures_of
from exograv.campaigns.process_faults.flight import Ground
from exograv.campaigns.process_faults.judge import CellVerdict
from exograv.model.description import load_rig

CELL = Cell.of("control:kill:floating")
GROUND = Ground(Path("participant.pickle"), load_rig("recupera_like"), 2, 1000)
EARLY = replace(evidence_of(Course()), struck_t=None, stopped_before="the guard stopped the machine")
GOOD = evidence_of(Course(descends_s=0.004))


def fly_as(patch: pytest.MonkeyPatch, *flights: FlightEvidence) -> list[str]:
    """Let the campaign fly these flights; return the list that will hold the folder names of its flights."""
    left, places = list(flights), list[str]()

    def fly(_cell: Cell, _expected: object, _ground: Ground, folder: Path) -> FlightEvidence:
        places.append(folder.name)
        return left.pop(0)

    patch.setattr(module, "fly", fly)
    return places


def test_a_flight_that_ended_before_the_strike_is_repeated(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    places = fly_as(monkeypatch, EARLY, GOOD)
    verdict = flown_cell(MatrixCampaign(out=tmp_path), CELL, GROUND, MACHINE, tmp_path)
    assert (verdict.status, verdict.tries) == ("as expected", 2)
    assert places == ["control_kill_floating_1", "control_kill_floating_2"]


def test_a_cell_that_never_was_struck_is_not_flown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    fly_as(monkeypatch, EARLY, EARLY, GOOD)
    verdict = flown_cell(MatrixCampaign(out=tmp_path, tries=2), CELL, GROUND, MACHINE, tmp_path)
    assert (verdict.status, verdict.tries) == ("not flown", 2)
    assert figures_of([verdict], [], 0, 2).is_bad


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


def test_an_interrupted_campaign_is_not_good(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(module, "prepared_ground", lambda *_: (GROUND, MACHINE))

    def interrupted(*_: object) -> FlightEvidence:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "fly", interrupted)
    figures = run_matrix(MatrixCampaign(only=("control:kill:floating",), out=tmp_path), lambda *_: None)
    assert figures.missing == ["control:kill:floating"]
    assert figures.is_bad


def test_a_verdict_is_the_same_after_the_checkpoint():
    verdict = CellVerdict("control:spin:floating", "not as expected", faults=("one", "two"), exit_code=1)
    assert verdict_of(asdict(verdict)) == verdict


def test_a_cell_that_cannot_be_flown_is_not_flown_and_not_bad(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    fly_as(monkeypatch)
    verdict = flown_cell(MatrixCampaign(out=tmp_path), Cell.of("console:kill:floating"), GROUND, MACHINE, tmp_path)
    assert verdict.status == "not in this session"
    assert not figures_of([verdict], [], 0, 2).is_bad
