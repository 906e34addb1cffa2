"""Samples of another device are in the file unchanged, whatever process dies, and delay no other process."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import ConfigError
from exograv.recording import Recording, read_recording
from exograv.recording.device_stream import DeviceStream
from exograv.recording.stream_block import StreamBlock, packed
from exograv.runtime.lsl.blocks import (
    BLOCK,
    CORRECTED,
    CORRECTION_ROW,
    DATA_BYTES,
    SAMPLES,
    SLOTS,
    TAKEN_MAX,
    RecordedDevices,
    block,
)
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.quality import StreamQuality
from exograv.runtime.lsl.streams import FoundStream, formats, quoted
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.recorder.recorder import Recorder

DEVICE = Path(__file__).with_name("device.py")
TYPES = ("float32", "double64", "int16", "int64")


@contextlib.contextmanager
def device(*streams: str) -> Iterator[subprocess.Popen]:
    """Another program that pushes counted samples into streams `NAME:TYPE`."""
    with subprocess.Popen([sys.executable, str(DEVICE), *streams], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield process
        finally:
            process.kill()


@contextlib.contextmanager
def recording(path: Path, *wanted: str) -> Iterator[tuple[Listening, Recorder]]:
    with Listening(wanted) as listening, Recorder(path, (), {}, 5.0, devices=listening.devices) as recorder:
        listening.begin(recorder.write)
        yield listening, recorder


def finished(listening: Listening, recorder: Recorder) -> Recording:
    listening.finish()
    assert recorder.finish().recording_ok
    return read_recording(recorder.path)


def written(path: Path, topic: str) -> int:
    """Return the samples that are in the file now."""
    return sum(len(stream.stamps) for stream in read_recording(path).streams if stream.topic == topic)


def noted(listening: Listening, what: str, count: int = 1):
    def is_noted() -> bool:
        listening.check()
        return sum(getattr(one, what) for one in listening.figures()) >= count

    return is_noted


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Recording of streams of all kinds, for three seconds."""
    path = tmp_path_factory.mktemp("streams") / "a.mcap"
    with (
        device(*(f"{one}:{one}" for one in TYPES), "keys:string"),
        recording(path, "EEG", "keys") as (listening, recorder),
    ):
        wait_until(lambda: min(written(path, f"/lsl/{one}") for one in (*TYPES, "keys")) > 30, "samples")
        wait_until(lambda: corrections(path) > 1, "a second correction")
        return finished(listening, recorder)


def corrections(path: Path) -> int:
    """Return the smallest number of samples of a stream so far."""
    return min(len(stream.corrections) for stream in read_recording(path).streams)


def stream_of(found: Recording, name: str) -> DeviceStream:
    return next(stream for stream in found.streams if stream.name == name)


@pytest.mark.parametrize("value_type", TYPES)
def test_numbers_and_stamps_are_recorded_bit_by_bit(undisturbed: Recording, value_type: str):
    stream = stream_of(undisturbed, value_type)
    counts = stream.values[:, 0].astype(int)
    kind = np.dtype({"double64": "float64"}.get(value_type, value_type))
    assert stream.values.dtype == kind
    np.testing.assert_array_equal(np.diff(counts), 1)
    np.testing.assert_array_equal(stream.values[:, 1], (counts / 3).astype(kind))
    np.testing.assert_array_equal(stream.values[:, 2], -stream.values[:, 0])
    # The device gave 10 000 s + n/7 on its own clock: stamps are neither smoothed nor shifted.
    np.testing.assert_array_equal(stream.stamps, 1e4 + counts / 7)


def test_texts_are_recorded_as_they_were_sent(undisturbed: Recording):
    texts = [text for (text,) in stream_of(undisturbed, "keys").values]
    first = int(texts[0].split()[-1])
    sent = range(first, first + 10 * len(texts), 10)
    assert texts == [f"Größer {'ß' * (count % 7)} als ½ {count}" for count in sent]


def test_the_whole_description_and_every_correction_are_kept(undisturbed: Recording):
    stream = stream_of(undisturbed, "float32")
    assert (stream.kind, stream.nominal_rate_Hz, stream.channels) == ("EEG", 200.0, 3)
    assert stream.labels == ("C0", "C1", "C2")
    assert stream.description.findtext("desc/maker") == "Nobody & Sons"
    assert len(stream.corrections) >= 2
    for one in stream.corrections:
        assert abs(one.offset) < 0.005  # one computer, one clock
        assert one.asked <= one.answered
        assert 0.0 < one.uncertainty < 0.1
        assert one.connection == 1


@pytest.mark.long
def test_a_device_that_dies_is_noted_and_awaited_and_comes_back_as_another_connection(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with device("amp:float32") as first, recording(path, "amp") as (listening, recorder):
        wait_until(lambda: written(path, "/lsl/amp") > 20, "samples of the first")
        first.kill()
        wait_until(noted(listening, "lost"), "the loss")
        with device("amp:float32"):
            before = written(path, "/lsl/amp")
            wait_until(lambda: written(path, "/lsl/amp") > before + 20, "samples of the second")
            found = finished(listening, recorder)
    (stream,) = found.streams
    assert [note.kind for note in stream.notes] == ["connected", "lost", "connected"]
    assert set(stream.connection.tolist()) == {1, 2}
    for number in (1, 2):
        np.testing.assert_array_equal(np.diff(stream.values[stream.connection == number, 0]), 1)


@pytest.mark.slow
def test_no_sample_is_missing_or_repeated_after_recorder_and_listener_were_killed(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with device("amp:float32"), recording(path, "amp") as (listening, recorder):
        wait_until(lambda: written(path, "/lsl/amp") > 20, "samples")
        os.kill(recorder.pid, signal.SIGKILL)
        wait_until(lambda: recorder.check().restarts == 1, "another recorder")
        before = written(path, "/lsl/amp")
        wait_until(lambda: written(path, "/lsl/amp") > before + 20, "samples after it")
        of_first = written(path, "/lsl/amp")
        os.kill(listening.pid, signal.SIGKILL)
        wait_until(noted(listening, "connected", 2), "another listener")
        wait_until(lambda: written(path, "/lsl/amp") > of_first + 40, "samples after it")
        found = finished(listening, recorder)
    (stream,) = found.streams
    counts = stream.values[:, 0].astype(int)
    for number in (1, 2):
        np.testing.assert_array_equal(np.diff(counts[stream.connection == number]), 1)
    assert counts[stream.connection == 1][-1] < counts[stream.connection == 2][0]  # a gap for the time between
    assert [note.kind for note in stream.notes] == ["connected", "connected"]


def test_a_listener_that_hangs_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    # Not less: a parent that stood still for half of it blames itself.
    monkeypatch.setattr("exograv.runtime.lsl.listening.HANGS_S", 2.0)
    path = tmp_path / "a.mcap"
    with device("amp:float32"), recording(path, "amp") as (listening, recorder):
        wait_until(noted(listening, "connected"), "the first listener")
        os.kill(listening.pid, signal.SIGSTOP)
        wait_until(noted(listening, "connected", 2), "another listener")
        before = written(path, "/lsl/amp")
        wait_until(lambda: written(path, "/lsl/amp") > before + 20, "samples after it")
        assert listening.restarts == 1
        assert [note.kind for note in finished(listening, recorder).streams[0].notes] == ["connected", "connected"]


@pytest.mark.long
def test_a_listener_of_which_only_the_threads_of_the_streams_go_on_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("exograv.runtime.lsl.listening.HANGS_S", 2.0)
    with device("amp:float32"), recording(tmp_path / "a.mcap", "amp") as (listening, _):
        wait_until(noted(listening, "connected"), "the listener")
        quality = StreamQuality("/lsl/amp", None, 0, None, None)
        with monkeypatch.context() as patched:
            patched.setattr(listening._child, "heard", lambda: [quality])
            wait_until(lambda: listening.check() or listening.restarts == 1, "another listener")


@pytest.mark.long
def test_a_listener_that_is_not_replaced_any_more_is_noted_as_lost_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with device("amp:float32"), recording(tmp_path / "a.mcap", "amp") as (listening, recorder):
        wait_until(noted(listening, "connected"), "the listener")
        monkeypatch.setattr(listening._child, "replace", lambda _: False)
        os.kill(listening.pid, signal.SIGKILL)
        wait_until(noted(listening, "lost"), "the loss")
        for _ in range(5):
            listening.check()
        notes = finished(listening, recorder).streams[0].notes
    assert [note.kind for note in notes] == ["connected", "lost"]


@pytest.mark.slow
def test_a_device_that_hangs_is_silent_and_then_resumed(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with device("amp:float32") as process, recording(path, "amp") as (listening, recorder):
        wait_until(lambda: written(path, "/lsl/amp") > 5, "samples")
        process.send_signal(signal.SIGSTOP)
        wait_until(noted(listening, "silent"), "the silence")
        process.send_signal(signal.SIGCONT)
        before = written(path, "/lsl/amp")
        wait_until(lambda: written(path, "/lsl/amp") > before, "samples again")
        found = finished(listening, recorder)
    kinds = [note.kind for note in found.streams[0].notes]
    assert kinds == ["connected", "silent", "resumed"]


def test_a_stream_that_is_not_there_is_an_error_that_names_those_that_are():
    with (
        device("amp:float32"),
        pytest.raises(ConfigError, match=r"'heart'.*Streams there: .*amp \(EEG, "),
    ):
        Listening(["amp", "heart"], within_s=0.5)


def test_a_full_ring_is_written_part_by_part_in_order_without_a_gap(tmp_path: Path):
    path, ring = tmp_path / "a.mcap", Ring(BLOCK, SLOTS)
    stream = FoundStream("amp", "1", "here", 3, 200.0, "int16", "EEG")
    devices = RecordedDevices(ring.name, formats([stream]))
    assert SLOTS > 3 * TAKEN_MAX
    with contextlib.closing(ring), Recorder(path, (), {}, 5.0, 0.02, devices=devices) as recorder:
        for k in range(SLOTS):
            samples = StreamBlock(float(k), 1, np.array([0.1 * k]), np.full((1, 3), k, np.int16))
            assert ring.put(block(0, SAMPLES, float(k), packed(samples, 3)))
        wait_until(lambda: ring.acknowledged == SLOTS, "all on the disk")
        assert recorder.finish().recording_ok
    (found,) = read_recording(path).streams
    np.testing.assert_array_equal(found.values[:, 0], np.arange(SLOTS))
    np.testing.assert_array_equal(found.stamps, 0.1 * np.arange(SLOTS))


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        (SAMPLES, {"stream": 1}),
        (7, {}),
        (SAMPLES, {"length": 0}),
        (SAMPLES, {"length": DATA_BYTES + 1}),
        (CORRECTED, {}),
        (CORRECTED, {"length": CORRECTION_ROW.itemsize}),
    ],
)
def test_a_block_that_cannot_be_ends_the_streams_and_not_the_recording(
    tmp_path: Path, kind: int, change: dict[str, int]
):
    path, ring = tmp_path / "a.mcap", Ring(BLOCK, SLOTS)
    devices = RecordedDevices(ring.name, formats([FoundStream("amp", "1", "here", 3, 200.0, "int16", "EEG")]))
    with contextlib.closing(ring), Recorder(path, (), {}, 5.0, 0.02, devices=devices) as recorder:
        samples = packed(StreamBlock(0.0, 1, np.array([0.1]), np.full((1, 3), 5, np.int16)), 3)
        ring.put(block(0, SAMPLES, 0.0, samples))
        wrong = block(0, kind, 1.0, samples if kind == SAMPLES else b"\xff" * 60)
        for name, value in change.items():
            wrong[name] = value
        ring.put(wrong)
        wait_until(lambda: recorder.check().unpublished, "the loss is told")
        recorder.write("/event", 2.0, {"kind": "note", "text": "it goes on"})
        report = recorder.finish()
        assert (report.recording_ok, report.restarts) == (True, 0)
    recorded = read_recording(path)
    assert [each["text"] for each in recorded.messages("/event")] == ["it goes on"]
    (found,) = recorded.streams
    np.testing.assert_array_equal(found.values, np.full((1, 3), 5))


def test_no_two_streams_share_a_channel_and_any_name_can_be_searched():
    names = ["a b", "a/b", "a b", "ü", 'say "x"', "it's"]
    streams = [FoundStream(name, str(k), "here", 1, 0.0, "float32", "EEG") for k, name in enumerate(names)]
    topics = [one.topic for one in formats(streams)]
    assert len(set(topics)) == len(names)
    assert all(first != second for first, second in itertools.combinations(topics, 2))
    assert quoted('say "x"') == "'say \"x\"'"
    with pytest.raises(ConfigError, match="both kinds"):
        quoted('"it\'s"')
