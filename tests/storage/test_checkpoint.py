"""Results from before an interruption are there afterwards, and those of another computation are refused."""

from pathlib import Path
from typing import Any

import pytest

from exograv.errors import RecordingError
from exograv.storage.checkpoint import CheckpointRows

HEAD = {"seed": 0, "level": 2}


def rows_in(path: Path, head: dict[str, int], resume: bool) -> CheckpointRows[dict[str, Any]]:
    return CheckpointRows(path, head, resume, dict, dict)


def test_a_resumed_file_has_all_rows_except_a_last_line_that_was_cut_off(tmp_path: Path):
    path = tmp_path / "new" / "rows.jsonl"
    rows_in(path, HEAD, resume=False).add({"number": 1}, {"number": 2})
    content = path.read_text()
    path.write_text(content[:-3])
    cut = rows_in(path, HEAD, resume=True)
    assert cut.rows == [{"number": 1}]
    cut.add({"number": 2})
    assert path.read_text() == content


def test_rows_of_another_computation_are_refused_with_the_difference(tmp_path: Path):
    rows_in(tmp_path / "rows.jsonl", HEAD, resume=False)
    with pytest.raises(RecordingError, match=r"now seed 1\)"):
        rows_in(tmp_path / "rows.jsonl", {**HEAD, "seed": 1}, resume=True)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"[1]\n", b'{"seed": 0, "level": 2}\nno\n{}\n'])
def test_a_damaged_file_is_refused_and_kept(tmp_path: Path, content: bytes):
    path = tmp_path / "rows.jsonl"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="--resume"):
        rows_in(path, HEAD, resume=True)
    assert path.read_bytes() == content


def test_a_file_that_is_not_resumed_is_kept_beside(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    rows_in(path, HEAD, resume=False).add({"number": 1})
    assert rows_in(path, HEAD, resume=False).rows == []
    assert '"number": 1' in (tmp_path / "rows.before.jsonl").read_text()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="--out"):
        rows_in(tmp_path / "file" / "rows.jsonl", HEAD, resume=False)
