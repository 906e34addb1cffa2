"""Erasing removes a person from all names and contents, packed or not, and leaves other people unchanged."""

import gzip
import json
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import pandas as pd
import pytest
from tests.study.made_up_sessions import settings, study_with, write_session

from exograv.errors import ConfigError, RecordingError
from exograv.recording import RecordingWriter
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.erasing import erase
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.tables import read_tables
from exograv.study.folder.journal import read_journal
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import read_register
from exograv.study.participants.searching import files_with


def full_study(tmp_path: Path) -> tuple[StudyFolder, str, str]:
    """Create two people with two sessions each, one under another code, an export, a report, and a replaced file."""
    folder, (one, other) = study_with(tmp_path / "study", "trained", "untrained")
    for k, code in enumerate((one, other)):
        first = write_session(tmp_path / f"{k}a.mcap", settings(code))
        old = write_session(tmp_path / f"{k}b.mcap", settings(f"P-0{k}", session=2))
        again = write_session(tmp_path / f"{k}c.mcap", settings(code, seed=9))
        add_files(folder, [first, old], AddOptions(new_code=(f"P-0{k}={code}",)))
        add_files(folder, [again], AddOptions(replace=True))
    export = folder.path / "bids"
    (export / f"sub-{one}").mkdir(parents=True)
    (export / "derivatives").mkdir()
    for place in (export, export / "derivatives"):
        (place / "dataset_description.json").write_text("{}")
    (export / "participants.tsv").write_text(f"participant_id\nsub-{one}\nsub-{other}\n")
    folder.report.mkdir()
    (folder.report / "report.html").write_text(f"<p>{one} and {other}</p>")
    (folder.derivatives / "statistics.json").write_text(json.dumps({one: 1.0}))
    return folder, one, other


def test_the_person_is_nowhere_and_the_other_is_as_before(tmp_path: Path):
    folder, one, other = full_study(tmp_path)
    before = read_tables(folder)
    raw = {path: path.read_bytes() for path in (folder.sources / other).rglob("*") if path.is_file()}
    receipt = erase(folder, one)
    assert receipt.is_proved
    assert list(files_with(folder.path, [one])) == []
    assert not any(one.encode() in path.read_bytes() for path in folder.path.rglob("*") if path.is_file())
    assert {path: path.read_bytes() for path in raw} == raw
    after = read_tables(folder)
    for name in ("touches", "windows", "sessions"):
        kept = getattr(before, name)
        pd.testing.assert_frame_equal(
            getattr(after, name), kept[kept["participant"] == other].reset_index(drop=True)
        )  # fmt: skip
    assert [row.code for row in read_register(folder)] == [other]


def test_the_receipt_counts_and_names_nobody(tmp_path: Path):
    folder, one, other = full_study(tmp_path)
    receipt = erase(folder, one)
    assert (receipt.sessions, receipt.quarantined, receipt.exports) == (2, 1, 1)
    (path,) = (folder.path / "receipts").iterdir()
    text = path.read_text()
    assert one not in text
    assert other not in text
    assert json.loads(text)["is_proved"]
    assert read_journal(folder)[-1].what == "erased"
    assert any(other in str(entry) for entry in read_journal(folder))


def test_a_code_that_the_study_does_not_have_erases_nothing(tmp_path: Path):
    folder, _, _ = full_study(tmp_path)
    before = sorted(folder.path.rglob("*"))
    with pytest.raises(ConfigError, match="Check the code"):
        erase(folder, "T9AA9TX")
    assert sorted(folder.path.rglob("*")) == before


def test_what_was_begun_is_finished_by_the_same_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder, one, _ = full_study(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("exograv.study.dataset.erasing.write_register", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            erase(folder, one)
    assert erase(folder, one).is_proved


def test_what_somebody_laid_into_the_folder_is_found_and_named(tmp_path: Path):
    folder, one, _ = full_study(tmp_path)
    (folder.path / "notes.txt").write_text(f"{one} was late")
    receipt = erase(folder, one)
    assert not receipt.is_proved
    assert receipt.left == ("notes.txt (bytes)",)
    assert "remove these files by hand" in receipt.sentence


@pytest.mark.parametrize("word", ["K9RR9PR", "P-02"])
def test_a_word_is_found_however_it_is_packed(tmp_path: Path, word: str):
    pd.DataFrame({"code": [word] * 5}).to_parquet(tmp_path / "a.parquet", compression="zstd")
    write_session(tmp_path / "b.mcap", settings(word))
    with gzip.open(tmp_path / "c.tsv.gz", "wt") as file:
        file.write(f"x\n{word}\n")
    with zipfile.ZipFile(tmp_path / "d.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("inside.txt", f"xxxx {word}")
    (tmp_path / f"sub-{word.lower()}").mkdir()
    (tmp_path / "e.json").write_text(word.lower())
    (tmp_path / "f.txt").write_text("nobody")
    with RecordingWriter(tmp_path / "g.mcap", ("elbow",), {"rig": "nobody"}):
        pass
    found = {path.name for path, _ in files_with(tmp_path, [word])}
    assert found == {"a.parquet", "b.mcap", "c.tsv.gz", "d.zip", "e.json", f"sub-{word.lower()}"}


def test_a_short_code_within_a_longer_word_is_another(tmp_path: Path):
    (tmp_path / "a.txt").write_text("0xA17 and P-021")
    (tmp_path / "b.txt").write_text("of A1, P-02.")
    found = {path.name for path, _ in files_with(tmp_path, ["A1", "P-02"])}
    assert found == {"b.txt"}


def test_a_word_across_two_pieces_of_a_file_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.study.participants.searching.PIECE_BYTES", 10)
    (tmp_path / "a.txt").write_text("123456K9RR9PR56789")
    assert [path.name for path, _ in files_with(tmp_path, ["K9RR9PR"])] == ["a.txt"]


def test_a_symbolic_link_in_place_of_the_persons_folder_is_refused_before_anything_is_removed(tmp_path: Path):
    folder, one, _ = full_study(tmp_path)
    elsewhere = tmp_path / "elsewhere"
    (folder.sources / one).rename(elsewhere)
    (folder.sources / one).symlink_to(elsewhere, target_is_directory=True)
    before = sorted(folder.path.rglob("*"))
    with pytest.raises(RecordingError, match=r"is a symbolic link to .*elsewhere") as refused:
        erase(folder, one)
    assert "None" not in str(refused.value)
    assert set(before) <= set(folder.path.rglob("*"))


def test_a_small_stream_in_a_pdf_that_unpacks_to_much_is_searched_in_pieces(tmp_path: Path):
    packed = zlib.compress(bytes(300_000_000) + b"K9RR9PR", 9)
    (tmp_path / "a.pdf").write_bytes(b"%PDF stream\n" + packed + b"\nendstream")
    tracemalloc.start()
    assert [path.name for path, _ in files_with(tmp_path, ["K9RR9PR"])] == ["a.pdf"]
    assert tracemalloc.get_traced_memory()[1] < 100_000_000
    tracemalloc.stop()
