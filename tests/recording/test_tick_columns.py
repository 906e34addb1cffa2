"""Packed ticks come back to the last bit, take less than half of the space, and stay visible to other programs."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import SeekingReader

from exograv.errors import RecordingError
from exograv.recording import RecordingWriter, read_recording
from exograv.recording.encoding import CDR_HEADER, empty_ticks, tick_dtype
from exograv.recording.pieces import tick_pieces
from exograv.recording.schema import PACKED_VERSION, SCHEMA_VERSION, TICK
from exograv.recording.tick_columns import COLUMNS_TOPIC, HEAD, VIEWED_EVERY, pack, unpack

JOINTS = ("shoulder_flexion", "elbow_flexion")


def run(n: int, n_joints: int = len(JOINTS)) -> np.ndarray:
    """Return ticks like those of a run: smooth references, noisy measurements, a torque that is seldom limited."""
    random, ticks = np.random.default_rng(0), empty_ticks(n, n_joints)
    t = 1e-3 * np.arange(n)
    ticks["t"] = ticks["now"] = t
    ticks["sequence"], ticks["phase"] = np.arange(n), 1
    smooth = np.sin(t[:, None] * (1.0 + np.arange(n_joints)))
    for name in ("q_reference", "v_reference", "a_reference"):
        ticks[name] = smooth
    ticks["q_measured"] = np.round(smooth / 1e-4) * 1e-4
    ticks["current"] = smooth + 0.1 * random.normal(size=smooth.shape)
    ticks["tau_measured"] = 6.5 * ticks["current"]
    ticks["tau_desired"] = ticks["tau_commanded"] = 10.0 * smooth + 0.1 * random.normal(size=smooth.shape)
    ticks["tau_commanded"][::50] = 3.0
    return ticks


def write(path: Path, ticks: np.ndarray, packed: bool) -> Path:
    with RecordingWriter(path, JOINTS, {"rig": "made_up"}, packed=packed) as recording:
        recording.phase(0.0, "identify")
        recording.ticks(ticks[: len(ticks) // 2])
        recording.write("/event", 0.5, {"kind": "note", "text": "Half of it."})
        recording.ticks(ticks[len(ticks) // 2 :])
    return path


BITS = st.integers(1, 40).flatmap(lambda n: arrays(np.uint8, (n, tick_dtype(2).itemsize)))


@given(BITS)
def test_any_bits_come_back_also_those_of_invalid_numbers(content: np.ndarray):
    ticks = content.copy().view(tick_dtype(2))[:, 0]
    ticks["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
    assert unpack(pack(ticks)).tobytes() == ticks.tobytes()


@pytest.mark.parametrize("n", [1, 2, 3, 2500])
@pytest.mark.parametrize("n_joints", [1, 4, 9])
def test_a_run_comes_back_to_the_last_bit(n: int, n_joints: int):
    ticks = run(n, n_joints)
    assert unpack(pack(ticks)).tobytes() == ticks.tobytes()


def test_a_packed_recording_holds_the_same_as_a_plain_one_in_less_than_half_of_the_space(tmp_path: Path):
    ticks = run(8000)
    plain, packed = (write(tmp_path / f"{kind}.mcap", ticks, kind) for kind in (False, True))
    one, other = read_recording(plain), read_recording(packed)
    assert one.ticks.tobytes() == other.ticks.tobytes() == ticks.tobytes()
    assert one.messages("/event") == other.messages("/event")
    assert other.remark is None
    assert np.concatenate(list(tick_pieces(packed))).tobytes() == ticks.tobytes()
    assert packed.stat().st_size < 0.5 * plain.stat().st_size
    assert [each.settings["schema_version"] for each in (one, other)] == [SCHEMA_VERSION, PACKED_VERSION]


def test_a_viewer_finds_every_tenth_tick_and_the_right_number_of_messages(tmp_path: Path):
    ticks = run(5000)
    with write(tmp_path / "a.mcap", ticks, True).open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        found = [(c.topic, m.data) for _, c, m in reader.iter_messages()]
        summary = reader.get_summary()
    rows = np.frombuffer(b"".join(data for topic, data in found if topic == TICK.topic), ticks.dtype)
    assert len(ticks) / VIEWED_EVERY <= len(rows) <= len(ticks) / VIEWED_EVERY + 5
    assert np.isin(rows["sequence"], ticks["sequence"]).all()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(found)
    assert any(topic == COLUMNS_TOPIC for topic, _ in found)


def test_a_packed_recording_that_was_cut_is_read_to_its_last_chunk_and_can_be_continued(tmp_path: Path):
    ticks, path = run(6000), tmp_path / "a.mcap"
    content = write(path, ticks, True).read_bytes()
    path.write_bytes(content[: int(0.7 * len(content))])
    before = read_recording(path)
    assert before.remark is not None
    assert before.ticks.tobytes() == ticks[: len(before.ticks)].tobytes()
    with pytest.raises(RecordingError, match="sound ticks"):
        RecordingWriter.continued(path, len(before.ticks) + 1)
    with RecordingWriter.continued(path, len(before.ticks)) as recording:
        assert recording.count(TICK.topic) == len(before.ticks) > 1000
        recording.ticks(ticks[len(before.ticks) :])
    after = read_recording(path)
    assert after.remark is None
    assert after.ticks.tobytes() == ticks.tobytes()


def test_a_message_that_is_cut_or_of_an_unknown_method_is_refused():
    data = pack(run(10))
    with pytest.raises(ValueError, match="do not have"):
        unpack(data[:-1])
    unknown = data[: HEAD.size] + b"\x63" + data[HEAD.size + 1 :]
    with pytest.raises(ValueError, match="unknown method 99"):
        unpack(unknown)
