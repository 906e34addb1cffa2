"""A recording gives back its input, survives an abrupt end, and reports what is wrong with a file."""

import json
import resource
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from exograv.errors import RecordingError
from exograv.recording import RecordingWriter, open_recording, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.recording.schema import TICK

JOINTS = ("shoulder_flexion", "elbow_flexion")
SETTINGS = {"rig": "recupera_like", "seed": 3}
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
PER_JOINT = [field.name for field in TICK.fields if field.size]


def tick_values(k: int) -> dict:
    """Return values that differ in each field and tick."""
    values = {name: np.array([k + 10.0 * i, -k - 10.0 * i]) for i, name in enumerate(PER_JOINT)}
    return {**values, "closure_slope": 1e-9 * k, "tick_us": 40.0 + k}


def write(path: Path, n_ticks: int) -> Path:
    with RecordingWriter(path, JOINTS, SETTINGS) as recording:
        recording.phase(0.0, "identify")
        for k in range(n_ticks):
            recording.tick(1e-3 * k, **tick_values(k))
        recording.phase(1e-3 * n_ticks, "float")
        recording.tick(1e-3 * n_ticks, **tick_values(n_ticks))
        recording.write("/event", 0.5, {"kind": "note", "text": "Größer als ½"})
    return path


def test_every_value_of_a_tick_comes_back(tmp_path: Path):
    ticks = read_recording(write(tmp_path / "a.mcap", 50)).ticks
    assert len(ticks) == 51
    for k in (0, 17, 50):
        assert ticks["t"][k] == 1e-3 * k
        for name, value in tick_values(k).items():
            np.testing.assert_array_equal(ticks[name][k], np.asarray(value).astype(ticks[name].dtype))


@given(seconds=st.floats(0.0, 1e6), value=st.floats(width=32, allow_nan=False))
def test_a_packed_tick_is_plain_cdr(seconds: float, value: float, tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("cdr") / "a.mcap"
    with RecordingWriter(path, ("elbow",), {}) as recording:
        recording.tick(seconds, **{name: np.array([value]) for name in PER_JOINT}, closure_slope=0.0, tick_us=1.0)
    with path.open("rb") as stream:
        (data,) = [message.data for _, channel, message in make_reader(stream).iter_messages("/tick")]
    codes = {"float64": "d", "float32": "f", "uint32": "I"}
    header, *values = struct.unpack("<4s" + "".join(codes[field.type] for field in TICK.fields), data)
    found = dict(zip((field.name for field in TICK.fields), values, strict=True))
    assert header == b"\x00\x01\x00\x00"
    assert found["t"] == seconds
    assert [found[name] for name in ("phase", "closure_slope", "tick_us")] == [0, 0.0, 1.0]
    assert np.isnan(found["lateness_us"])  # a virtual clock is never late
    assert [found[name] for name in ("safe_state", "sequence")] == [0, 0]  # no safe state, no count
    assert [found[name] for name in PER_JOINT] == [value] * len(PER_JOINT)


@pytest.mark.parametrize("n_joints", [1, 2, 4, 7])
def test_no_field_of_a_tick_needs_padding(n_joints: int):
    dtype = tick_dtype(n_joints)
    offset = 0
    for field in TICK.fields:
        assert offset % dtype[field.name].base.itemsize == 0
        offset += dtype[field.name].itemsize
    assert dtype.itemsize == 4 + offset


def test_messages_come_back_in_order_with_their_time(tmp_path: Path):
    recording = read_recording(write(tmp_path / "a.mcap", 5))
    assert [phase["name"] for phase in recording.messages("/phase")] == ["identify", "float"]
    assert recording.last("/event") == {"t": 0.5, "kind": "note", "text": "Größer als ½"}
    assert recording.messages("/left_over") == []
    assert recording.settings["joints"] == list(JOINTS)
    assert recording.remark is None


def test_ticks_know_their_phase(tmp_path: Path):
    recording = read_recording(write(tmp_path / "a.mcap", 5))
    assert len(recording.phase_ticks("identify")) == 5
    assert len(recording.phase_ticks("float")) == 1
    assert len(recording.phase_ticks("weigh")) == 0


def test_the_same_run_gives_the_same_bytes(tmp_path: Path):
    first, second = write(tmp_path / "a.mcap", 20), write(tmp_path / "b.mcap", 20)
    assert first.read_bytes() == second.read_bytes()


def test_a_cut_file_is_read_up_to_its_last_whole_chunk(tmp_path: Path):
    path = write(tmp_path / "a.mcap", 20_000)
    whole = read_recording(path).ticks
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    cut = read_recording(path)
    assert 0.3 * len(whole) < len(cut.ticks) < len(whole)
    assert cut.ticks.tobytes() == whole[: len(cut.ticks)].tobytes()
    assert cut.remark is not None
    assert "ends abruptly at" in cut.remark


def test_a_killed_writer_loses_at_most_one_chunk(tmp_path: Path):
    recording = RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS)
    for k in range(20_000):
        recording.tick(1e-3 * k, **tick_values(k))
    on_disk = read_recording(recording.path)
    recording.close()
    ticks_per_chunk = 1_000_000 // tick_dtype(len(JOINTS)).itemsize + 1
    assert 20_000 - len(on_disk.ticks) <= ticks_per_chunk


def test_an_event_is_on_disk_at_once(tmp_path: Path):
    recording = RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS)
    recording.tick(0.0, **tick_values(0))
    recording.write("/event", 0.0, {"kind": "stop", "text": "A joint moved faster than allowed."})
    on_disk = read_recording(recording.path)
    recording.close()
    assert on_disk.last("/event")["kind"] == "stop"
    assert len(on_disk.ticks) == 1


def test_a_recording_is_completed_when_the_run_fails(tmp_path: Path):
    def fail() -> None:
        with RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS) as recording:
            recording.tick(0.0, **tick_values(0))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert read_recording(tmp_path / "a.mcap").remark is None


def test_a_damaged_chunk_ends_the_reading(tmp_path: Path):
    path = write(tmp_path / "a.mcap", 20_000)
    content = bytearray(path.read_bytes())
    last_chunk = content.rfind(ZSTD_MAGIC)
    content[last_chunk + 100 : last_chunk + 164] = bytes(64)
    path.write_bytes(content)
    recording = read_recording(path)
    assert 0 < len(recording.ticks) < 20_000
    assert recording.remark is not None


def test_a_tick_with_a_value_missing_is_refused(tmp_path: Path):
    values = tick_values(0)
    del values["v"]
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS) as recording, pytest.raises(ValueError, match="needs"):
        recording.tick(0.0, **values)


def test_a_message_that_is_not_in_the_table_is_refused(tmp_path: Path):
    with (
        RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS) as recording,
        pytest.raises(RecordingError, match="unknown 'colour', missing 'text'"),
    ):
        recording.write("/event", 0.0, {"kind": "note", "colour": "red"})


def test_a_number_that_json_cannot_hold_is_refused(tmp_path: Path):
    with (
        RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS) as recording,
        pytest.raises(RecordingError, match="Use null"),
    ):
        recording.write("/result", 0.0, {"simulated_s": float("nan")})


def test_a_torque_beyond_32_bits_is_recorded_as_infinite_without_a_warning(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, SETTINGS) as recording:
        recording.tick(0.0, **{**tick_values(0), "tau_feedforward": np.array([1e100, -1e100])})
    np.testing.assert_array_equal(read_recording(tmp_path / "a.mcap").ticks["tau_feedforward"], [[np.inf, -np.inf]])


def test_a_full_disk_is_a_readable_error():
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full, which stands for a full disk")
    with pytest.raises(RecordingError, match="No space left"):
        RecordingWriter(full, JOINTS, SETTINGS)


def test_a_disk_that_fills_up_during_the_run_leaves_a_readable_recording(tmp_path: Path):
    path, noise = tmp_path / "a.mcap", np.random.default_rng(0).normal(size=(len(PER_JOINT), 2))

    def run() -> None:
        with RecordingWriter(path, JOINTS, SETTINGS) as recording:
            for k in range(40_000):
                values = dict(zip(PER_JOINT, noise * np.sin(k), strict=True))
                recording.tick(1e-3 * k, closure_slope=0.0, tick_us=50.0, **values)

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (800_000, limits[1]))
    try:
        with pytest.raises(RecordingError, match="cannot be written"):
            run()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    on_disk = read_recording(path)
    assert 1000 < len(on_disk.ticks) < 40_000
    assert on_disk.remark is not None


def test_settings_that_are_not_in_the_table_are_refused_before_a_file_exists(tmp_path: Path):
    with pytest.raises(RecordingError, match="unknown 'colour'"):
        RecordingWriter(tmp_path / "a.mcap", JOINTS, {"colour": "red"})
    assert not (tmp_path / "a.mcap").exists()


def test_a_path_that_cannot_be_written_is_a_readable_error(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot be written"):
        RecordingWriter(tmp_path / "file" / "a.mcap", JOINTS, SETTINGS)


def test_another_version_is_refused_with_the_version_that_wrote_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.recording.writer.SCHEMA_VERSION", 999)
    path = write(tmp_path / "a.mcap", 1)
    with pytest.raises(RecordingError, match="version 999"):
        read_recording(path)


@pytest.mark.parametrize("content", [b"", b"t,q\n1,2\n", b"\x89MCAP0\r"])
def test_a_file_of_another_kind_is_refused(content: bytes, tmp_path: Path):
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match="not an MCAP file"):
        read_recording(tmp_path / "a.mcap")


def test_a_recording_without_settings_is_refused(tmp_path: Path):
    path = write(tmp_path / "a.mcap", 1)
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(RecordingError, match="no /settings"):
        read_recording(path)


def test_a_missing_file_is_a_readable_error(tmp_path: Path):
    with pytest.raises(RecordingError, match="cannot be read"):
        read_recording(tmp_path / "none.mcap")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("joints", 3, "'joints' is 3, not a list of values of the type string"),
        ("joints", [1, 2], r"'joints\[0\]' is 1, not of the type string"),
        ("joints", None, "'joints' is missing"),
        ("joints", ["elbow_flexion"], "name 1 joints, and its ticks have another number"),
        ("rig", 7, "'rig' is 7, not of the type string"),
        ("seed", True, "'seed' is true, not of the type integer"),
        ("schema_version", "3", "'schema_version' is \"3\", not of the type integer"),
    ],
)
@pytest.mark.parametrize("read", [read_recording, open_recording])
def test_settings_of_a_wrong_type_are_refused_with_their_name_and_value(
    read: Callable[[Path], object], name: str, value: object, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = write(tmp_path / "a.mcap", 3)

    def altered(text: bytes) -> dict[str, object]:
        message = json.JSONDecoder().decode(text.decode())
        return message | {name: value} if "joints" in message else message

    monkeypatch.setattr("exograv.recording.message_check.json.loads", altered)
    with pytest.raises(RecordingError, match=said):
        read(path)
