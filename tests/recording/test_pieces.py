"""A recording read in pieces has the same content as a whole one, and takes memory for one piece only."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.recording import (
    RecordingPass,
    RecordingWriter,
    open_recording,
    read_recording,
    read_topics,
    stored_messages,
    tick_pieces,
)
from exograv.recording.stored_messages import StoredMessages

JOINTS = ("shoulder", "elbow")
NAMES = (
    "q_measured", "q_reference", "v", "current", "tau_measured", "tau_feedforward", "tau_desired", "tau_commanded",
)  # fmt: skip


def written(path: Path, ticks: int = 12_000) -> Path:
    with RecordingWriter(path, JOINTS, {"rig": "made up"}) as recording:
        for k in range(ticks):
            values = {name: np.full(2, k + 0.5) for name in NAMES}
            recording.tick(1e-3 * k, closure_slope=0.0, tick_us=1.0, sequence=k + 1, **values)
            if k % 1000 == 0:
                recording.write("/event", 1e-3 * k, {"kind": "note", "text": str(k)})
    return path


def test_joined_pieces_are_bitwise_all_ticks(tmp_path: Path):
    path = written(tmp_path / "run.mcap")
    pieces = list(tick_pieces(path))
    assert len(pieces) > 1
    assert np.concatenate(pieces).tobytes() == read_recording(path).ticks.tobytes()


def test_only_chosen_messages_are_kept(tmp_path: Path):
    path = written(tmp_path / "run.mcap")
    whole, chosen = read_recording(path), read_topics(path, ["/event"])
    assert chosen.messages("/event") == whole.messages("/event")
    assert chosen.settings == whole.settings
    assert len(chosen.ticks) == 0
    assert chosen.messages("/phase") == []


def test_messages_of_a_long_channel_stay_in_the_file_and_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = written(tmp_path / "run.mcap")
    monkeypatch.setattr(stored_messages, "IN_MEMORY_BYTES", 200)
    found = read_topics(path, ["/event"]).messages("/event")
    assert isinstance(found, StoredMessages)
    assert list(found) == read_recording(path).messages("/event")


def test_long_settings_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = written(tmp_path / "run.mcap", 10)
    monkeypatch.setattr(stored_messages, "IN_MEMORY_BYTES", 2)
    for read in (open_recording, lambda path: read_topics(path, ())):
        assert read(path).settings == read_recording(path).settings


@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_a_cut_file_gets_the_remark_of_the_whole_reader(tmp_path: Path, share: float):
    path = written(tmp_path / "run.mcap")
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    whole, passing = read_recording(path), RecordingPass(path)
    assert sum(len(ticks) for ticks in passing.ticks()) == len(whole.ticks)
    assert passing.recording().remark == whole.remark
    assert whole.remark is not None


def test_a_flipped_byte_ends_the_pieces_where_it_ends_the_whole_recording(tmp_path: Path):
    path = written(tmp_path / "run.mcap")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))
    whole, passing = read_recording(path), RecordingPass(path)
    assert sum(len(ticks) for ticks in passing.ticks()) == len(whole.ticks)
    assert "damaged" in str(passing.recording().remark)


def test_a_file_that_is_not_a_recording_is_refused_with_a_message(tmp_path: Path):
    (tmp_path / "letter.mcap").write_text("Dear all")
    with pytest.raises(RecordingError, match="not an MCAP file"):
        read_topics(tmp_path / "letter.mcap", [])
    with pytest.raises(RecordingError, match="cannot be read"):
        list(tick_pieces(tmp_path / "missing.mcap"))
