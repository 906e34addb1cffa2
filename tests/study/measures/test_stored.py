"""Stored measures of a recording are used until the recording changes, and no longer."""

from pathlib import Path

import pytest
from tests.study.made_up_sessions import settings, study_with
from tests.study.measures.test_recordings import write_session

from exograv.study.dataset.adding import add_files
from exograv.study.dataset.making import current_tables
from exograv.study.dataset.options import AddOptions
from exograv.study.measures import stored
from exograv.study.measures.stored import measure_study


@pytest.fixture
def study(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add_files(folder, [write_session(tmp_path / "a.mcap", settings=settings(code))], AddOptions())
    return folder, code


def test_a_recording_is_read_once_and_the_second_time_says_the_same(study):
    folder, code = study
    read = list[str]()
    first, second = (measure_study(folder, current_tables(folder), read.append) for _ in range(2))
    assert len(read) == 1
    assert first.measures.equals(second.measures)
    assert first.traces.equals(second.traces)
    assert first.measures["measure"].tolist().count("joint_sparc") == 3
    assert set(first.traces["participant"]) == {code}


def test_a_recording_that_changed_or_another_way_to_measure_is_read_anew(study, monkeypatch: pytest.MonkeyPatch):
    folder, _ = study
    tables = current_tables(folder)
    measure_study(folder, tables)
    read = list[str]()
    changed = type(tables)(
        tables.touches, tables.windows, tables.sessions.assign(sha256="f" * 64), tables.participants
    )  # fmt: skip
    measure_study(folder, changed, read.append)
    assert len(read) == 1
    monkeypatch.setattr(stored, "VERSION", 99)
    measure_study(folder, changed, read.append)
    assert len(read) == 2


def test_what_is_no_longer_a_session_leaves_no_measure(study):
    folder, _ = study
    tables = current_tables(folder)
    measure_study(folder, tables)
    left = measure_study(folder, type(tables)(*(getattr(tables, n).iloc[:0] for n in vars(tables))))
    assert left.measures.empty
    assert left.traces.empty


def test_a_recording_that_cannot_be_read_is_named_and_stops_nothing(study):
    folder, code = study
    tables = current_tables(folder)
    folder.source(tables.sessions["source"].iloc[0]).write_bytes(b"no recording")
    found = measure_study(folder, tables)
    (remark,) = found.remarks
    assert code in remark
    assert "median_deviation_px" in set(found.measures["measure"])
