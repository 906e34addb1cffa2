"""Errors of a stream are found with their size: clock, rate, jitter, gaps, foreign clock.

A sound stream has no remark.
"""

from pathlib import Path

import numpy as np
import pytest

from exograv.cli.recordings.sync import Sync, run_sync
from exograv.cli.shell.base_options import OutFolder
from exograv.errors import RecordingError
from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed
from exograv.report.of_recording.recording_report import page_of
from exograv.report.style.page import page_text
from exograv.study.sync import StreamSync, sync_figures

RATE_HZ = 250.0
START_S = 7e4
"""Beginning of the run on CLOCK_MONOTONIC [s]."""

AHEAD_S = -6e4
"""Beginning on the rig's clock [s]."""

SHIFT_S, DRIFT = 321.0, 30e-6
"""Offset and drift of the device's clock: ahead, and fast."""

NOISE_S = 20e-6
ARRIVES_S = 0.004
XML = (
    "<info><name>amp</name><type>EEG</type><channel_count>1</channel_count>"
    "<nominal_srate>250</nominal_srate><desc/></info>"
)


def on_device(monotonic: np.ndarray, shift: float = SHIFT_S) -> np.ndarray:
    return monotonic + shift + DRIFT * (monotonic - START_S)


class Bench:
    """Recording of one minute with known properties."""

    def __init__(self, path: Path, seed: int = 1000):
        self.path, self._rng = path, np.random.default_rng(seed)
        self._writer = RecordingWriter(path, (), {}, [StreamFormat("/lsl/amp", "int32")])
        rows = np.zeros(6001, tick_dtype(0))
        rows["cdr_header"] = (0, 1, 0, 0)
        rows["monotonic"] = START_S + 0.01 * np.arange(6001)
        rows["t"] = rows["now"] = rows["monotonic"] + AHEAD_S
        self._writer.ticks(rows)
        self.connection = 0

    def connect(self, true: np.ndarray, shift: float = SHIFT_S, stamps: np.ndarray | None = None) -> None:
        """Add a connection with samples at these times [s]."""
        self.connection += 1
        head = {"topic": "/lsl/amp", "connection": self.connection}
        note = {"monotonic": true[0], "kind": "connected", "text": "It is recorded.", "xml": XML}
        self._writer.write("/stream", 0.0, {**head, **note})
        stamps = on_device(true, shift) if stamps is None else stamps
        for k in range(0, len(true), 25):
            values = np.arange(k, k + len(true[k : k + 25]), dtype=np.int32)[:, None]
            block = StreamBlock(true[k : k + 25][-1] + ARRIVES_S, self.connection, stamps[k : k + 25], values)
            self._writer.write_block("/lsl/amp", 0.0, packed(block, 1))
        for asked in np.arange(true[0], true[-1], 2.0):
            remote = float(on_device(np.array([asked]), shift)[0])
            offset = asked - remote + NOISE_S * self._rng.standard_normal()
            times = {"asked": asked, "answered": asked + 1e-3, "remote": remote}
            self._writer.write("/correction", 0.0, {**head, **times, "offset": offset, "uncertainty": 2e-4})

    def figures(self) -> tuple[StreamSync, Recording]:
        self._writer.close()
        recording = read_recording(self.path)
        (stream,) = sync_figures(recording).streams
        return stream, recording


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path / "a.mcap")


def sampled(first: float = 0.0, last: float = 60.0) -> np.ndarray:
    return START_S + np.arange(first, last, 1.0 / RATE_HZ)


def test_a_sound_stream_is_put_on_the_robots_clock_and_nothing_is_remarked(bench: Bench):
    true = sampled()
    bench.connect(true)
    figures, recording = bench.figures()
    (stream,) = recording.streams
    np.testing.assert_array_equal(stream.stamps, on_device(true))  # unchanged
    np.testing.assert_allclose(stream.monotonic, true, rtol=0.0, atol=NOISE_S)
    np.testing.assert_allclose(stream.t, true + AHEAD_S, rtol=0.0, atol=NOISE_S)
    (clock,) = figures.clocks
    assert clock.drift_ci95_ppm is not None
    assert figures.jitter_us is not None
    assert figures.certain_to_us is not None
    assert figures.arrival_ms is not None
    low, high = clock.drift_ci95_ppm
    assert low <= -1e6 * DRIFT <= high
    assert high - low < 2.0
    assert figures.effective_rate_Hz == pytest.approx(RATE_HZ, rel=1e-6)
    assert figures.jitter_us.max < 1.0
    # The first part is half of the round trip. The second part is the line's own uncertainty: 2.05 (1 + √3) / √30
    # standard deviations at its ends, which are known to a third from 30 measurements.
    assert 100.0 < figures.certain_to_us < 100.0 + 1.33 * 1.02 * 1e6 * NOISE_S
    assert 1e6 * np.max(np.abs(stream.monotonic - true)) < figures.certain_to_us
    assert 4.0 <= figures.arrival_ms.p50 <= 4.0 + 100.0
    assert (figures.gaps_total, figures.remarks) == (0, [])


def test_missing_samples_are_a_gap_at_their_time_on_the_robots_clock(bench: Bench):
    true = sampled()
    bench.connect(np.delete(true, np.arange(5000, 5010)))
    figures, _ = bench.figures()
    (gap,) = figures.gaps
    assert gap.t == pytest.approx(true[4999] + AHEAD_S, abs=1e-3)
    assert gap.seconds == pytest.approx(11 / RATE_HZ, rel=1e-3)
    assert gap.samples == 10
    assert figures.effective_rate_Hz == pytest.approx(RATE_HZ, rel=1e-6)
    assert any("10 samples missing" in remark for remark in figures.remarks)


def test_jitter_of_stamps_is_measured_and_left_in_them(bench: Bench):
    true, jitter = sampled(), 300e-6
    stamps = on_device(true) + jitter * np.random.default_rng(1001).standard_normal(len(true))
    bench.connect(true, stamps=stamps)
    figures, recording = bench.figures()
    assert figures.jitter_us is not None
    assert figures.jitter_us.sd == pytest.approx(1e6 * jitter, rel=0.03)
    np.testing.assert_array_equal(recording.streams[0].stamps, stamps)


def test_a_device_that_came_back_is_corrected_by_the_clock_of_each_connection(bench: Bench):
    first, second = sampled(0.0, 25.0), sampled(30.0, 60.0)
    bench.connect(first)
    bench.connect(second, shift=-777.0)
    figures, recording = bench.figures()
    true = np.concatenate([first, second])
    np.testing.assert_allclose(recording.streams[0].monotonic, true, rtol=0.0, atol=NOISE_S)
    assert [clock.connection for clock in figures.clocks] == [1, 2]
    assert figures.gaps_total == 0
    assert any("connected 2 times" in remark for remark in figures.remarks)


def test_a_device_that_does_not_stamp_by_lsls_clock_is_remarked_and_its_stamps_are_certain_to_nothing(bench: Bench):
    true = sampled()
    bench.connect(true, stamps=on_device(true) - 40.0)
    figures, _ = bench.figures()
    assert figures.certain_to_us is None
    assert any("does not use LSL's clock" in remark for remark in figures.remarks)


def test_a_rate_that_is_not_the_nominal_one_and_stamps_that_run_back_are_remarked(bench: Bench):
    true = START_S + np.arange(0.0, 60.0, 1.0 / 240.0)
    stamps = on_device(true)
    stamps[[300, 301]] = stamps[[301, 300]]
    bench.connect(true, stamps=stamps)
    figures, _ = bench.figures()
    assert any("240.0" in remark and "states 250" in remark for remark in figures.remarks)
    assert figures.backward_stamps == 1


def test_the_command_draws_and_says_what_it_found(bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    bench.connect(sampled())
    bench.figures()
    result = run_sync(Sync(bench.path), OutFolder(out=tmp_path))
    assert Path(result.figure).is_file()
    assert result.found.robot is not None
    assert result.found.robot.ticks == 6001
    assert result.found.robot.scatter_us.max < 1.0
    assert "amp" in capsys.readouterr().out


def test_the_report_has_a_chapter_of_the_devices_that_says_what_is_missing(bench: Bench):
    bench.connect(np.concatenate([sampled(0.0, 20.0), sampled(30.0, 60.0)]))
    figures, recording = bench.figures()
    page = page_text(page_of(recording))
    assert "Are other devices on the same clock?" in page
    assert f"to {figures.certain_to_us:.0f} µs, with one gap" in page


def test_a_recording_without_streams_says_how_to_get_some(tmp_path: Path):
    RecordingWriter(tmp_path / "a.mcap", ("elbow",), {}).close()
    with pytest.raises(RecordingError, match="--record-stream"):
        sync_figures(read_recording(tmp_path / "a.mcap"))
