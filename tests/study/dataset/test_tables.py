"""Tables have exactly the columns of the contract, in memory and when read from the disk."""

from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest
from pandas.testing import assert_frame_equal

from exograv.errors import RecordingError
from exograv.study.dataset.tables import MADE_BY, Tables, frame, read_tables, write_tables
from exograv.study.folder.columns import PARTICIPANTS, SESSIONS, TABLES, TOUCHES, WINDOWS
from exograv.study.folder.study_folder import StudyFolder

ROW = {
    "participant": "K9RR9PR", "protocol": "training", "session": 1, "sequence": 4, "page": "p", "t_s": 1.5,
    "is_accepted": True, "x_px": 1.0, "y_px": 2.0, "deviation_x_px": 3.0, "deviation_y_px": 4.0, "deviation_px": 5.0,
}  # fmt: skip


def tables() -> Tables:
    windowed = {**ROW, "sequence": 5, "window": 3, "attempt": 1}
    people = frame(PARTICIPANTS, [{"participant": "K9RR9PR"}])
    return Tables(frame(TOUCHES, [ROW, windowed]), frame(WINDOWS, []), frame(SESSIONS, []), people)


def test_what_is_written_comes_back_with_the_same_types(tmp_path: Path):
    folder, before = StudyFolder(tmp_path), tables()
    write_tables(folder, before)
    after = read_tables(tmp_path)
    for name in TABLES:
        assert_frame_equal(getattr(before, name), getattr(after, name))
    assert after.touches["window"].isna().tolist() == [True, False]
    assert str(after.touches["window"].dtype) == "Int64"
    assert str(after.touches["page"].dtype) == "str"


def test_a_file_says_which_version_made_it(tmp_path: Path):
    write_tables(StudyFolder(tmp_path), tables())
    assert b"tables 1" in (pq.read_schema(tmp_path / "derivatives" / "touches.parquet").metadata or {})[MADE_BY]


def test_a_row_with_a_strange_or_a_missing_column_is_a_mistake():
    with pytest.raises(ValueError, match="No such column: weight"):
        frame(TOUCHES, [{**ROW, "weight": 1.0}])
    with pytest.raises(ValueError, match="t_s"):
        frame(TOUCHES, [{name: value for name, value in ROW.items() if name != "t_s"}])


def test_tables_that_are_missing_or_of_another_making_say_what_to_do(tmp_path: Path):
    with pytest.raises(RecordingError, match="--remake"):
        read_tables(tmp_path)
    write_tables(StudyFolder(tmp_path), tables())
    pd.DataFrame({"other": [1]}).to_parquet(tmp_path / "derivatives" / "sessions.parquet")
    with pytest.raises(RecordingError, match="columns of another version"):
        read_tables(tmp_path)
