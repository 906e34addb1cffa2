"""A recording that stays in its file gives the same ticks, messages and streams as one in memory."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.errors import RecordingError
from exograv.recording import RecordingWriter, open_recording, read_recording, stored_messages
from exograv.recording import computing_times as module
from exograv.recording.computing_times import computing_times
from exograv.recording.encoding import empty_ticks
from exograv.recording.stored_messages import StoredMessages
from exograv.recording.stored_ticks import last_seconds, rows_at
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed

JOINTS = ("shoulder", "elbow")
FIELDS = ("t", "tau_measured", "tau_commanded")
PHASES = ("identify", "float", "identify")


def ticks(n: int, phase: int, start: int) -> np.ndarray:
    random, found = np.random.default_rng(phase), empty_ticks(n, len(JOINTS))
    found["t"], found["phase"] = 1e-3 * (start + np.arange(n)), phase
    for name in ("current", "tau_measured", "tau_desired", "tau_commanded"):
        found[name] = random.normal(size=(n, len(JOINTS)))
    found["tau_measured"] = 6.5 * found["current"]
    found["tau_commanded"][: n // 2] = found["tau_desired"][: n // 2]
    return found


@pytest.fixture(params=[False, True], ids=["rows", "columns"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return a recording of three phases, with events."""
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {"rig": "made up"}, packed=request.param) as recording:
        for number, name in enumerate(PHASES, start=1):
            recording.phase(6.0 * number, name)
            for part in range(3):
                recording.ticks(ticks(1200, number, 3600 * number + 1200 * part))
                text = "x" * (50 * number + part)
                recording.write("/event", 6.0 * number, {"kind": "note", "text": text})
    return tmp_path / "a.mcap"


def test_chosen_fields_of_all_ticks_are_bitwise_those_in_memory(path: Path):
    stored, whole = open_recording(path), read_recording(path)
    assert len(stored.ticks) == 0
    pieces = list(stored.pieces(FIELDS))
    assert len(pieces) > 3
    for name in FIELDS:
        assert np.concatenate([piece[name] for piece in pieces]).tobytes() == whole.ticks[name].tobytes()


@pytest.mark.parametrize("name", [*sorted(set(PHASES)), "weigh"])
def test_ticks_of_a_phase_are_those_of_its_last_occurrence(path: Path, name: str):
    stored, whole = open_recording(path), read_recording(path)
    found = np.concatenate([np.empty(0), *(piece["t"] for piece in stored.phase_pieces(name, FIELDS))])
    assert found.tolist() == whole.phase_ticks(name)["t"].tolist()
    assert stored.phase_length(name) == whole.phase_length(name) == len(found)


def test_messages_that_stay_in_the_file_are_the_same(path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(stored_messages, "IN_MEMORY_BYTES", 200)
    stored, whole = open_recording(path).messages("/event"), read_recording(path).messages("/event")
    assert isinstance(stored, StoredMessages)
    assert list(stored) == whole
    assert [stored[k] for k in (5, 0, -1)] == [whole[k] for k in (5, 0, -1)]
    assert stored[2:4] == whole[2:4]


def test_a_file_that_is_no_recording_is_refused_as_by_the_other_reader(tmp_path: Path):
    with pytest.raises(RecordingError, match="cannot be read"):
        open_recording(tmp_path / "none.mcap")
    (tmp_path / "a.mcap").write_bytes(b"something else")
    with pytest.raises(RecordingError, match="not an MCAP file"):
        open_recording(tmp_path / "a.mcap")


def test_stamps_of_other_devices_are_on_the_same_clock(tmp_path: Path):
    stream = StreamFormat("/lsl/EEG", "float32")
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {"rig": "made up"}, [stream]) as recording:
        rows = ticks(3000, 0, 0)
        rows["now"], rows["monotonic"] = rows["t"], 100.0 + 1.001 * rows["t"]
        recording.ticks(rows)
        correction = {"topic": stream.topic, "connection": 1, "asked": 1.0, "answered": 1.0, "offset": 100.0,
                      "remote": 1.0, "uncertainty": 1e-4}  # fmt: skip
        for k in range(10):
            recording.write("/correction", 0.3 * k, correction | {"remote": 0.3 * k, "asked": 0.3 * k})
            block = StreamBlock(100.3 + 0.3 * k, 1, 0.3 * k + 0.01 * np.arange(30), np.ones((30, 4), np.float32))
            recording.write_block(stream.topic, 0.3 * k, packed(block, 4))
    (stored,), (whole,) = open_recording(tmp_path / "a.mcap").streams, read_recording(tmp_path / "a.mcap").streams
    assert np.isfinite(whole.t).all()
    for name in ("stamps", "received", "connection", "monotonic", "t"):
        assert getattr(stored, name).tobytes() == getattr(whole, name).tobytes()
    assert stored.values.size == 0


@given(
    arrays(np.float32, st.integers(1, 60), elements=st.floats(1, 50, width=32) | st.sampled_from([2.0, np.nan, -1.0])),
    st.lists(st.floats(0, 100), min_size=1, max_size=4),
)
def test_percentiles_of_counted_times_are_those_of_all_times(tick_us: np.ndarray, which: list[float]):
    rows = empty_ticks(len(tick_us), 1)
    rows["tick_us"] = tick_us
    times, measured = computing_times([rows[:10], rows[10:]], 1), tick_us[np.isfinite(tick_us) & (tick_us > 0)]
    assert len(times) == len(measured)
    assert np.repeat(times.values_us, times.counts).tolist() == np.sort(measured).tolist()
    if len(measured):
        assert times.percentiles(which) == np.percentile(measured, which).tolist()


def test_counted_times_are_merged_over_many_pieces(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "BLOCK", 5)
    rows = ticks(4, 1, 0)
    rows["tick_us"] = [1.0, 2.0, 2.0, 3.0]
    times = computing_times([rows[[k]] for k in (0, 1, 2, 3)] + [np.repeat(rows, 4)] * 2, len(JOINTS))
    assert times.counts.tolist() == [9, 18, 9]
    assert times.limited_share.tolist() == [0.5, 0.5]


@given(st.lists(st.integers(0, 5), min_size=1, max_size=6), st.data())
def test_rows_and_the_last_seconds_are_those_of_the_joined_pieces(sizes: list[int], data: st.DataObject):
    whole = ticks(sum(sizes), 1, 0)
    pieces = np.split(whole, np.cumsum(sizes)[:-1])
    rows = np.array(sorted(data.draw(st.sets(st.integers(0, len(whole) - 1)) if len(whole) else st.just(set()))), int)
    assert rows_at(pieces, rows).tobytes() == whole[rows].tobytes()
    last = last_seconds(pieces, 3.5e-3)
    assert (b"" if last is None else last.tobytes()) == whole[-4:].tobytes()
