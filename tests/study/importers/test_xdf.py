"""XDF gives the same touches as a recording from our markers, and touches of other software by a mapping."""

import gzip
import json
from pathlib import Path

import pytest
import tomlkit
from tests.study.importers.xdf_file import stream, write_xdf
from tests.study.made_up_sessions import BEGUN_S, run_records, settings, study_with, write_session

from exograv.errors import RecordingError
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.making import refresh
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.tables import frame, read_tables
from exograv.study.folder.columns import SESSIONS, TOUCHES, WINDOWS
from exograv.study.importers import xdf_stream
from exograv.study.importers.recording import import_recording
from exograv.study.importers.xdf import OURS, import_xdf
from exograv.study.importers.xdf_mapping import XdfMapping

KEY = {"participant": "K9RR9PR", "protocol": "training", "session": 1}
FOREIGN = XdfMapping(
    stream="Touches",
    columns={"window": "block", "x_px": "x", "y_px": "y", "target_x_px": 3, "target_y_px": 4},
    fixed={"gravity_level": 1.0},
)
LABELS = ("block", "x", "y", "tx", "ty")


def markers(extra: tuple[str, ...] = ()) -> bytes:
    texts = ["phase: task", *(json.dumps(record) for record in run_records()), *extra]
    return stream(1, OURS, [50.0 + k for k in range(len(texts))], [[text] for text in texts])


def foreign(stamps: list[float], **more) -> bytes:
    samples = [[1.0, 100.0 + k, 200.0, 90.0, 210.0] for k in range(len(stamps))]
    return stream(2, "Touches", stamps, samples, LABELS, **more)


def test_our_markers_give_the_rows_of_the_recording(tmp_path: Path):
    by_xdf = import_xdf(write_xdf(tmp_path / "lab.xdf", markers(), foreign([1.0, 2.0])))
    recorded = import_recording(write_session(tmp_path / "run.mcap", settings("K9RR9PR")))
    # The first marker is a second after the first tick.
    shifted = [{**row, "t_s": row["t_s"] + run_records()[0]["t"] - BEGUN_S} for row in by_xdf.touches]
    for mine, theirs in zip(shifted, recorded.touches, strict=True):
        assert mine == {**theirs, "t_s": pytest.approx(theirs["t_s"])}
    for name in ("touches", "rejected", "windows_complete", "is_complete"):
        assert by_xdf.session[name] == recorded.session[name]


def test_rows_fit_the_contract(tmp_path: Path):
    for found in (
        import_xdf(write_xdf(tmp_path / "ours.xdf", markers())),
        import_xdf(write_xdf(tmp_path / "theirs.xdf", foreign([1.0, 2.0])), FOREIGN),
    ):
        frame(TOUCHES, [{**KEY, **row} for row in found.touches])
        frame(WINDOWS, [{**KEY, **row} for row in found.windows])
        frame(SESSIONS, [{**KEY, **found.session, "source": "a", "sha256": "b"}])


def test_a_marker_that_is_no_record_is_refused_and_counted(tmp_path: Path):
    found = import_xdf(write_xdf(tmp_path / "lab.xdf", markers(('{"kind": "touch"}',))))
    assert len(found.refusals) == 1
    assert "were refused: 1" in found.session["remark"]


def test_touches_of_somebody_else_are_read_by_the_mapping(tmp_path: Path):
    found = import_xdf(write_xdf(tmp_path / "lab.xdf", foreign([10.0, 12.5, 15.0])), FOREIGN)
    assert [row["t_s"] for row in found.touches] == pytest.approx([0.0, 2.5, 5.0])
    assert [row["deviation_x_px"] for row in found.touches] == [10.0, 11.0, 12.0]
    assert found.touches[0]["deviation_px"] == pytest.approx(200.0**0.5)


def test_measured_offsets_move_stamps_and_intervals_stay(tmp_path: Path):
    found = import_xdf(write_xdf(tmp_path / "lab.xdf", foreign([10.0, 12.5, 15.0], offset=-3.0)), FOREIGN)
    assert [row["t_s"] for row in found.touches] == pytest.approx([0.0, 2.5, 5.0], abs=1e-6)


def test_stamps_that_go_back_and_gaps_are_counted(tmp_path: Path):
    back = import_xdf(write_xdf(tmp_path / "back.xdf", foreign([10.0, 12.0, 11.0])), FOREIGN).session
    assert back["clock_jumps"] == 1
    gaps = import_xdf(write_xdf(tmp_path / "gaps.xdf", foreign([1.0, 2.0, 6.0, 7.0], rate=1.0)), FOREIGN).session
    assert "samples: 1" in gaps["remark"]


def test_what_is_not_in_the_file_is_said(tmp_path: Path):
    path = write_xdf(tmp_path / "lab.xdf", foreign([1.0, 2.0]))
    with pytest.raises(RecordingError, match="need a mapping"):
        import_xdf(path)
    wrong = FOREIGN.model_copy(update={"columns": {**FOREIGN.columns, "x_px": "across"}})
    with pytest.raises(RecordingError, match="labelled block, x, y, tx, ty"):
        import_xdf(path, wrong)
    (tmp_path / "letter.xdf").write_text("Dear all")
    with pytest.raises(RecordingError, match="not XDF"):
        import_xdf(tmp_path / "letter.xdf")


def test_xdf_comes_into_a_study_and_its_tables_can_be_made_again(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_xdf(tmp_path / "lab.xdf", foreign([1.0, 2.0]))
    (tmp_path / "mapping.toml").write_text(tomlkit.dumps(FOREIGN.model_dump(exclude_none=True)), encoding="utf-8")
    options = AddOptions(participant=code, protocol="training", session=2, mapping=tmp_path / "mapping.toml")
    assert [one.what for one in add_files(folder, [path], options)] == ["added"]
    before = read_tables(folder).touches
    assert refresh(folder, everything=True).touches.equals(before)


def test_a_packed_file_that_would_take_the_whole_memory_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(xdf_stream, "UNPACKED_BYTES_MAX", 1_000_000)
    monkeypatch.setattr("pyxdf.load_xdf", lambda *_, **__: pytest.fail("the file was unpacked"))
    path = tmp_path / "bomb.xdfz"
    path.write_bytes(gzip.compress(b"XDF:" + bytes(3_000_000)))
    with pytest.raises(RecordingError, match=r"more than 0\.001 GB when it is unpacked"):
        import_xdf(path)
