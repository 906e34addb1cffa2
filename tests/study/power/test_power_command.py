"""`exograv study power` keeps its contract, and states the next step if it cannot compute a result."""

import json
from pathlib import Path
from typing import Any

import pytest
from tests.study.statistics.made_up_touches import made_up_touches

from exograv.cli.shell.command import act, command_class
from exograv.cli.study.power import run_power
from exograv.errors import ConfigError, RecordingError
from exograv.study.dataset.tables import Tables, frame, write_tables
from exograv.study.folder.columns import SESSIONS, WINDOWS
from exograv.study.folder.settings import AS_PUBLISHED, write_settings
from exograv.study.folder.study_folder import StudyFolder

QUICK: dict[str, Any] = {"n_max": 6, "studies": 500}


def planned(**options: Any) -> dict[str, Any]:
    """Return the figures of the command."""
    return act(run_power, command_class(run_power)(**options))


def pilot(folder: Path, complete: int = 5) -> Path:
    """Return a study's folder with tables only: three trained, three untrained people, five windows, some complete."""
    touches, participants = made_up_touches((3, 3))
    window = {
        "protocol": "flight", "session": 1, "attempt": 1, "opened_by": "clock", "marks": "", "gravity_level": 0.0,
        "touches": 8, "rejected": 0,
    }  # fmt: skip
    windows = [
        {"participant": code, "window": k, "opened_s": 180.0 * k, "is_complete": k <= complete, **window}
        for code in participants["participant"]
        for k in range(1, 6)
    ]
    session = {
        "protocol": "flight", "session": 1, "source": "a.csv", "sha256": "0" * 64, "kind": "csv", "is_simulated": True,
        "is_complete": True, "duration_s": 60.0, "windows_complete": 5, "touches": 40, "rejected": 0, "ticks": 0,
        "clock_jumps": 0, "stops": 0,
    }  # fmt: skip
    sessions = frame(SESSIONS, [{"participant": code, **session} for code in participants["participant"]])
    write_settings(StudyFolder(folder), AS_PUBLISHED)
    write_tables(StudyFolder(folder), Tables(touches, frame(WINDOWS, windows), sessions, participants))
    return folder


def test_stated_assumptions_give_the_figures_of_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    result = json.loads(json.dumps(planned(sd=0.25, difference=0.9, seat_cost=6000.0, out=tmp_path, **QUICK)))
    assert 4 <= result["n_per_group"]["80"] <= result["n_per_group"]["90"] <= 6
    assert {"n", "power", "width_factor", "p_min", "seats", "cost"} <= set(result["curve"][0])
    assert result["pilot"] is None
    text = capsys.readouterr().out
    assert "cannot reach 0.05" in " ".join(text.split())
    assert "36,000" in text
    assert "<svg" in Path(result["figure"]).read_text()


def test_touches_of_windows_that_were_broken_off_are_no_pilot_as_they_are_none_for_the_report(tmp_path: Path):
    assert planned(pilot=pilot(tmp_path, 3), out=tmp_path, **QUICK)["pilot"]["touches"] == 6 * 3 * 8


def test_a_pilot_gives_assurance_beside_power_and_is_called_simulated(tmp_path: Path, capsys):
    result = planned(pilot=pilot(tmp_path), out=tmp_path, **QUICK)
    assert result["pilot"]["people"] == [3, 3]
    assert all("assurance" in row for row in result["curve"])
    assert result["n_per_group_assurance"].keys() == {"80", "90"}
    assert result["assumptions"]["windows"] == 5
    assert "no evidence about people" in " ".join(capsys.readouterr().out.split())


def test_a_stated_spread_comes_before_the_pilot_s_and_has_no_assurance(tmp_path: Path):
    result = planned(pilot=pilot(tmp_path), sd=0.9, out=tmp_path, **QUICK)
    assert result["assumptions"]["person_sd"] == 0.9
    assert result["n_per_group_assurance"] is None


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({}, "Give a study with --from, or give --sd"),
        ({"pilot": Path("nowhere")}, "nowhere is not a study: study.toml is missing"),
        ({"sd": -1.0}, "--sd is -1"),
        ({"sd": 0.3, "n_max": 1}, "--n-max is 1"),
        ({"sd": 0.3, "seed": -1}, "--seed is -1"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_the_way_on(options: dict, word: str):
    with pytest.raises(ConfigError, match=word):
        planned(**options)


def test_a_folder_without_tables_is_refused(tmp_path: Path):
    write_settings(StudyFolder(tmp_path), AS_PUBLISHED)
    with pytest.raises(RecordingError, match=r"touches\.parquet cannot be read"):
        planned(pilot=tmp_path)


@pytest.mark.parametrize("groups", ["trained", "a,b", "trained,trained", ""])
def test_groups_that_the_study_does_not_have_are_refused(tmp_path: Path, groups: str):
    with pytest.raises(ConfigError, match=r"two groups of study\.toml, separated by a comma: trained, untrained"):
        planned(pilot=pilot(tmp_path), groups=groups)
