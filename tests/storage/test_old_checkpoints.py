"""Checkpoints of version 0.1.0 are still read; one of each kind is kept in `data`."""

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from exograv.campaigns.benchmark_identification.runs import RunFile
from exograv.campaigns.faults.checkpoint import FILE, row_of, verdict_of
from exograv.campaigns.sweep.store import Store
from exograv.campaigns.sweep.table_task import TABLE
from exograv.campaigns.virtual_study.checkpoint import CAREER_FILE
from exograv.console.run_checkpoint import RunContext
from exograv.loop.replay_log import read_machine
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.participant_record import read_assist
from exograv.storage.checkpoint import CheckpointRows
from exograv.storage.session_checkpoint import read_kept
from exograv.study.folder.journal import note, read_journal
from exograv.study.folder.study_folder import StudyFolder

DATA = Path(__file__).with_name("data")


def copied(name: str, folder: Path) -> Path:
    """Copy a checkpoint, because a resumed file is written to."""
    return Path(shutil.copy(DATA / name, folder / name))


def head_of(path: Path) -> dict[str, object]:
    return json.loads(path.read_text(encoding="utf-8").splitlines()[0])


def test_a_campaign_of_faults_goes_on(tmp_path: Path):
    path = copied(FILE, tmp_path)
    before = path.read_bytes()
    kept = CheckpointRows(path, head_of(path), True, row_of, verdict_of)
    assert [len(verdict.scenario.faults) for verdict in kept.rows] == [1, 3, 1]
    assert path.read_bytes() == before
    kept.add(kept.rows[0])
    again = CheckpointRows(path, head_of(path), True, row_of, verdict_of)
    assert again.rows == kept.rows  # the row was written with the fields that verdicts have had since


def test_a_benchmark_goes_on(tmp_path: Path):
    path = copied("benchmark_identification.jsonl", tmp_path)
    before, seconds = path.read_bytes(), head_of(path)["seconds"]
    assert isinstance(seconds, float)
    file = RunFile(path, seconds, resume=True)
    assert [(run.method, run.setting) for run in file.rows] == [
        ("recursive", "open_loop"),
        ("recursive", "closed_loop"),
    ]
    assert path.read_bytes() == before
    file.add(file.rows[0])
    again = RunFile(path, seconds, resume=True)
    assert again.rows == file.rows  # the row was written with the fields that cases have had since
    assert again.rows[-1].case.world == "home"


def test_a_training_and_what_its_participant_learned_come_back():
    path = DATA / "training.run.json"
    kept = read_kept(path, json.loads(path.read_text(encoding="utf-8"))["options"])
    assert kept.person is not None
    assert kept.learned is not None
    assert np.isfinite(read_machine(kept.person.machine).phi).all()
    assert json.loads(kept.run)["status"] == "finished"


def test_the_run_of_a_console_comes_back():
    kept = read_kept(DATA / "console.run.json", {"participant": "P-13", "session": 1})
    assert RunContext.model_validate(kept.before).side == "right"


def test_sessions_of_assist_as_needed_come_back():
    options = AssistOptions(rig="recupera_like_qdd", participant="P-07", level=2, seed=1001)
    file = read_assist(DATA / "assist.json", "P-07", options.kept)
    assert [(session.number, len(session.blocks), session.is_over) for session in file.sessions] == [(1, 6, True)]


def test_what_came_of_a_career_comes_back(tmp_path: Path):
    lived = CAREER_FILE.read(DATA / "career.json")
    assert len(lived.flights) == 1
    CAREER_FILE.write(tmp_path / "career.json", lived)
    assert (tmp_path / "career.json").read_bytes() == (DATA / "career.json").read_bytes()


def test_parts_of_a_sweep_are_rows_of_the_state_that_made_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "sweep_parts" / TABLE.name).mkdir(parents=True)
    path = copied("sweep_part.parquet", tmp_path / "sweep_parts" / TABLE.name)
    row = pq.read_table(path).to_pylist()[0]
    made_by = {name.removeprefix("version_"): value for name, value in row.items() if name.startswith("version_")}
    monkeypatch.setattr("exograv.campaigns.sweep.store.versions", lambda: made_by)
    assert list(Store(tmp_path, TABLE).done.values()) == ["done", "done"]


def test_a_journal_with_half_a_line_goes_on(tmp_path: Path):
    folder = StudyFolder(tmp_path)
    folder.log.write_bytes(b'{"at": "2026-11-23", "what": "added", "sentence": "A file."}\n{"at": "2026')
    note(folder, "erased", "Größe")
    assert [entry.what for entry in read_journal(folder)] == ["added", "erased"]
