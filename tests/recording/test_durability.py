"""Synced data are in the file wherever it was cut, alterations are found, and a failing disk is reported."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader

from exograv.errors import RecordingError
from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.recording.contents import FileEnding, examine
from exograv.recording.disk import expected_bytes, refuse_small_disk
from exograv.recording.encoding import tick_dtype, unpacked_ticks
from exograv.recording.schema import SCHEMA_VERSION

JOINTS = ("shoulder_flexion", "elbow_flexion")
OLD = Path(__file__).parent / "data"
CHUNKS, TICKS_PER_CHUNK = 4, 3


def rows(first: int, count: int) -> np.ndarray:
    ticks = np.zeros(count, tick_dtype(len(JOINTS)))
    ticks["sequence"] = np.arange(first, first + count)
    ticks["t"] = 1e-3 * ticks["sequence"]
    ticks["v"] = np.sin(ticks["t"])[:, None]
    return ticks


def write(path: Path, chunks: int = CHUNKS) -> Path:
    """Content of a complete file of several syncs."""
    with RecordingWriter(path, JOINTS, {"seed": 3}) as recording:
        for k in range(chunks):
            recording.phase(1e-3 * TICKS_PER_CHUNK * k, str(k))
            recording.ticks(rows(TICKS_PER_CHUNK * k, TICKS_PER_CHUNK))
            recording.sync()
        recording.write("/event", 1.0, {"kind": "note", "text": "the end"})
    return path


def sequence(recording: Recording) -> list[int]:
    return recording.ticks["sequence"].tolist()


def told(content: bytes) -> tuple[bytes, list[tuple[str, bytes]], FileEnding]:
    """Return ticks, other messages, and the state of the file's end."""
    ticks, others = [], []
    found = examine(content, lambda topic, data: (ticks if topic == "/tick" else others).append((topic, data)))
    return b"".join(data for _, data in ticks), others, found.ending


def prefixes(content: bytes, step: int) -> list[int]:
    """Return lengths of crash images: at regular places, and around the end of each part of a chunk."""
    marks = [k for k in range(len(content)) if content.startswith(b"\x28\xb5\x2f\xfd", k)]
    near = {mark + d for mark in marks for d in range(-60, 3)}
    return sorted(near | set(range(8, len(content), step)))


@pytest.mark.parametrize("step", [211, pytest.param(7, marks=pytest.mark.slow)])
def test_every_crash_image_holds_a_prefix_of_the_messages_and_says_that_it_was_cut(step: int, tmp_path: Path):
    content = write(tmp_path / "a.mcap").read_bytes()
    ticks, others, ending = told(content)
    assert ending is FileEnding.COMPLETE
    for length in prefixes(content, step):
        some_ticks, some_others, some_ending = told(content[:length])
        assert ticks.startswith(some_ticks)
        assert some_others == others[: len(some_others)]
        assert some_ending is FileEnding.CUT


@pytest.mark.parametrize("step", [97, pytest.param(7, marks=pytest.mark.slow)])
@pytest.mark.parametrize("is_complete", [True, False])
def test_no_altered_byte_changes_a_message_without_notice(is_complete: bool, step: int, tmp_path: Path):
    content = write(tmp_path / "a.mcap").read_bytes()
    if not is_complete:
        content = content[: content.rfind(b"\x28\xb5\x2f\xfd") + 40]
    ticks, others, ending = told(content)
    rng = np.random.default_rng(0)
    for place in prefixes(content, step):
        altered = bytearray(content)
        altered[place] ^= 1 << int(rng.integers(8))
        some_ticks, some_others, some_ending = told(bytes(altered))
        assert ticks.startswith(some_ticks)
        assert some_others == others[: len(some_others)]
        if len(some_ticks) < len(ticks) or is_complete:
            assert some_ending is not FileEnding.COMPLETE
    assert ending is (FileEnding.COMPLETE if is_complete else FileEnding.CUT)


def test_the_zeros_that_a_power_failure_leaves_at_the_end_are_no_ticks(tmp_path: Path):
    path = write(tmp_path / "a.mcap")
    content = path.read_bytes()
    path.write_bytes(content[: content.rfind(b"\x28\xb5\x2f\xfd")] + bytes(5000))
    recording = read_recording(path)
    assert recording.remark is not None
    assert "is damaged" in recording.remark
    assert sequence(recording) == list(range(CHUNKS * TICKS_PER_CHUNK))


def test_a_file_that_was_cut_anywhere_can_be_continued(tmp_path: Path):
    content, path = write(tmp_path / "a.mcap").read_bytes(), tmp_path / "b.mcap"
    head = len(content) - len(content.split(b"\x28\xb5\x2f\xfd", 1)[1]) + 400
    for length in [*range(head, len(content), 997), len(content)]:
        path.write_bytes(content[:length])
        before = sequence(read_recording(path))
        with RecordingWriter.continued(path) as recording:
            kept = recording.count("/tick")
            recording.ticks(rows(kept, 2))
            recording.phase(9.0, "on")
        found = read_recording(path)
        assert found.remark is None
        assert before[:kept] == list(range(kept))
        assert sequence(found) == list(range(kept + 2))
        assert len(before) - kept in (0, TICKS_PER_CHUNK)  # a chunk without its complete index is cut off
        assert found.last("/phase")["name"] == "on"


def test_a_continued_file_is_the_file_that_was_never_interrupted(tmp_path: Path):
    whole = write(tmp_path / "a.mcap", 3)
    path = write(tmp_path / "b.mcap", 2)
    content = path.read_bytes()
    with RecordingWriter.continued(path) as recording:
        pass
    assert path.read_bytes() == content  # the end of the file was removed and written again
    path.write_bytes(content[: content.rfind(b"\x28\xb5\x2f\xfd") - 40])  # within the head of the last chunk
    with RecordingWriter.continued(path, ticks_safe=6) as recording:
        recording.phase(1e-3 * 6, "2")
        recording.ticks(rows(6, 3))
        recording.sync()
        recording.write("/event", 1.0, {"kind": "note", "text": "the end"})
    assert path.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("phases", [0, 1, 3, CHUNKS, CHUNKS + 5])
def test_a_file_that_is_continued_with_fewer_messages_is_the_file_before_the_next_message(tmp_path: Path, phases: int):
    path = write(tmp_path / "longer.mcap")
    with RecordingWriter.continued(path, kept={"/phase": phases}) as recording:
        kept = min(phases, CHUNKS)
        assert recording.count("/phase") == kept
        assert recording.t_last == (1.0 if kept == CHUNKS else pytest.approx(1e-3 * max(TICKS_PER_CHUNK * kept - 1, 0)))
    if kept < CHUNKS:
        whole = read_recording(path)
        assert whole.remark is None
        assert sequence(whole) == list(range(TICKS_PER_CHUNK * kept))
        assert not whole.messages("/event")


def test_ticks_of_a_continued_file_know_their_phase(tmp_path: Path):
    path, zero = write(tmp_path / "a.mcap"), np.zeros(2)
    names = ("q_measured", "q_reference", "v", "current", "tau_measured", "tau_feedforward", "tau_desired")
    with RecordingWriter.continued(path) as recording:
        values = dict.fromkeys([*names, "tau_commanded"], zero)
        recording.tick(2.0, closure_slope=0.0, tick_us=1.0, **values)
    assert len(read_recording(path).phase_ticks(str(CHUNKS - 1))) == 1


def test_other_programs_find_all_ticks_of_a_continued_file_by_its_index(tmp_path: Path):
    path = write(tmp_path / "a.mcap")
    with RecordingWriter.continued(path) as recording:
        recording.ticks(rows(12, 5))
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        times = [message.log_time for _, _, message in reader.iter_messages("/tick")]
        summary = reader.get_summary()
    assert times == [1_000_000 * k for k in range(17)]
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.channel_message_counts[2] == 17


def test_a_file_with_fewer_ticks_than_promised_is_not_cut(tmp_path: Path):
    path = write(tmp_path / "a.mcap")
    content = path.read_bytes()[:-3000]
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="holds 12 sound ticks, and 99 were"):
        RecordingWriter.continued(path, ticks_safe=99)
    assert path.read_bytes() == content


@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_file_of_an_older_version_is_read_and_not_continued(version: int):
    path = OLD / f"version_{version}.mcap"
    old = read_recording(path)
    assert old.remark is None
    assert old.settings["schema_version"] == version
    np.testing.assert_array_equal(old.ticks["t"], 1e-3 * np.arange(5))
    np.testing.assert_array_equal(old.ticks["tick_us"], 40.0 + np.arange(5))
    np.testing.assert_array_equal(old.ticks["q_measured"][4], [4.0, -4.0])
    np.testing.assert_array_equal(old.ticks["tau_commanded"][4], [74.0, -74.0])
    counted = version > 1
    np.testing.assert_array_equal(old.ticks["lateness_us"], 7.0 + np.arange(5) if counted else np.full(5, np.nan))
    assert old.ticks["safe_state"].tolist() == ([0, 1, 2, 0, 1] if counted else [0] * 5)
    assert old.ticks["sequence"].tolist() == ([100, 101, 102, 103, 104] if counted else [0] * 5)
    assert np.isnan(old.ticks["v_reference"]).all()
    assert np.isnan(old.ticks["monotonic"]).all()
    assert old.last("/event")["text"] == "Größer als ½"
    with pytest.raises(RecordingError, match="Start a new one"):
        RecordingWriter.continued(path)


def test_ticks_of_the_present_version_are_not_copied():
    data = rows(0, 3).tobytes()
    assert unpacked_ticks(data, len(JOINTS), SCHEMA_VERSION).tobytes() == data


def test_all_ticks_counted_by_a_sync_are_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path, synced = tmp_path / "a.mcap", list[int]()
    monkeypatch.setattr(os, "fdatasync", lambda file: synced.append(os.fstat(file).st_size))
    recording = RecordingWriter(path, JOINTS, {})
    for k in range(3):
        recording.ticks(rows(10 * k, 10))
        assert recording.sync() == 10 * (k + 1)
        assert synced[-1] == path.stat().st_size
        assert len(read_recording(path).ticks) == 10 * (k + 1)
    recording.close()


def fails(code: int) -> Callable[..., None]:
    def raise_it(*_: object) -> None:
        raise OSError(code, os.strerror(code))

    return raise_it


@pytest.mark.parametrize(("code", "advice"), [(errno.ENOSPC, "Free some space"), (errno.EIO, "The disk fails")])
def test_a_sync_that_fails_ends_the_recording_and_is_never_repeated(
    code: int, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "a.mcap"
    recording = RecordingWriter(path, JOINTS, {})
    recording.ticks(rows(0, 10))
    assert recording.sync() == 10
    monkeypatch.setattr(os, "fdatasync", fails(code))
    recording.ticks(rows(10, 10))
    with pytest.raises(RecordingError, match=advice):
        recording.sync()
    monkeypatch.setattr(os, "fdatasync", lambda _: pytest.fail("A failed sync was repeated."))
    with pytest.raises(RecordingError, match=advice):
        recording.sync()
    with pytest.raises(RecordingError, match=advice):
        recording.write("/event", 0.0, {"kind": "note", "text": "x"})
    recording.close()
    found = read_recording(path)
    assert sequence(found)[:10] == list(range(10))
    assert found.remark is not None


def test_disk_space_is_checked_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    class Usage:
        free = 2 * expected_bytes(4, 60.0)

    monkeypatch.setattr("shutil.disk_usage", lambda _: Usage)
    refuse_small_disk(tmp_path / "new" / "a.mcap", 4, 60.0)
    with pytest.raises(RecordingError, match="run for a shorter time"):
        refuse_small_disk(tmp_path / "new" / "a.mcap", 4, 60.1)


def test_the_expected_size_is_not_less_than_the_real_one(tmp_path: Path):
    path, count = tmp_path / "a.mcap", 20_000
    ticks = rows(0, count)
    names = [name for name in ticks.dtype.names or () if ticks.dtype[name].shape == (len(JOINTS),)]
    rng = np.random.default_rng(0)
    for name in names:
        ticks[name] = rng.normal(size=(count, len(JOINTS)))  # random values compress least
    with RecordingWriter(path, JOINTS, {}) as recording:
        for first in range(0, count, 250):
            recording.ticks(ticks[first : first + 250])
            recording.sync()
    assert path.stat().st_size < expected_bytes(len(JOINTS), 1e-3 * count)


def test_an_altered_file_is_refused_by_other_programs_too(tmp_path: Path):
    content = bytearray(write(tmp_path / "a.mcap").read_bytes())
    content[content.find(b"\x28\xb5\x2f\xfd") + 30] ^= 1
    (tmp_path / "a.mcap").write_bytes(content)
    with (tmp_path / "a.mcap").open("rb") as stream, pytest.raises((McapError, ValueError, zstandard.ZstdError)):
        list(make_reader(stream, validate_crcs=True).iter_messages())


def test_the_settings_of_a_file_are_its_first_message(tmp_path: Path):
    _, others, _ = told(write(tmp_path / "a.mcap").read_bytes())
    assert others[0][0] == "/settings"
    assert json.loads(others[0][1])["joints"] == list(JOINTS)
