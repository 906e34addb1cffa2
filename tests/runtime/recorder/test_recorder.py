"""Acknowledged data are in the file after any kill, and the writer of the rings is never delayed."""

import contextlib
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from mcap.reader import make_reader
from tests.waiting import wait_until

from exograv.errors import RecordingError
from exograv.recording import read_recording
from exograv.recording.encoding import tick_dtype
from exograv.recording.guard_state import state_in
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import LoopOutcome, Timing
from exograv.runtime.recorder.recorder import FRUITLESS_MAX, TICKS_WAITING_MAX, Recorder, timing_message
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    GAVE_UP,
    PHASE,
    RING_TICKS,
    Inlet,
    RecorderJob,
    event,
    guard_dtype,
    record,
)
from exograv.safety.state import VERSION

JOINTS = ("shoulder_flexion", "elbow_flexion")
SETTINGS = {"rig": "recupera_like", "hashes": {"rig": "0" * 64}}
RUN_S = 5.0
SOON_S = 20.0  # for a slow computer; no tested event takes so long
PUT_US = 1000.0  # nine in ten puts are shorter, with checked types on a busy computer; a sync here takes 300 ms
KILLS = Path(__file__).parents[3] / "benchmarks" / "recorder_kills.py"
SYNC_S = 0.02  # ten times as often as in a run, so that a kill hits a sync more often


def rows(first: int, count: int) -> np.ndarray:
    """Return ticks that differ, counted."""
    ticks = np.zeros(count, tick_dtype(len(JOINTS)))
    ticks["sequence"] = np.arange(first, first + count)
    ticks["t"] = 1e-3 * ticks["sequence"]
    ticks["q_measured"] = ticks["t"][:, None]
    ticks["lateness_us"] = 3.0
    return ticks


class Control:
    """Mock of the loop: puts counted ticks, and measures how long each takes."""

    def __init__(self, recorder: Recorder):
        self._ticks, self._events = recorder.inlet.ticks(), recorder.inlet.events()
        self._guards = recorder.inlet.guards()
        self.count = 0
        self.put_us: list[float] = []

    def put(self, count: int) -> None:
        for row in rows(self.count, count):
            start = time.perf_counter_ns()
            self._ticks.put(row)
            self.put_us.append(1e-3 * (time.perf_counter_ns() - start))
        self.count += count

    def say(self, kind: str, text: str) -> None:
        assert self._events.put(event(1e-3 * self.count, kind, text))

    def keep_guard(self, now: float, numbers: list[float]) -> None:
        """Put a state of the guard."""
        row = np.zeros((), guard_dtype(len(JOINTS)))
        row["now"], row["t"], row["persons"], row["size"] = now, now, 1, len(numbers)
        row["numbers"][: len(numbers)] = numbers
        assert self._guards.put(row)

    def close(self) -> None:
        for ring in (self._ticks, self._events, self._guards):
            ring.close()


@contextlib.contextmanager
def recording(path: Path, sync_every_s: float = SYNC_S) -> Iterator[tuple[Recorder, Control]]:
    with (
        Recorder(path, JOINTS, SETTINGS, RUN_S, sync_every_s) as recorder,
        contextlib.closing(Control(recorder)) as control,
    ):
        yield recorder, control


def file_size_limit(pid: int, size: int) -> None:
    """Let the kernel refuse to write, as on a full disk."""
    _, hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))


def test_ticks_and_events_put_into_the_rings_come_back_from_the_file(tmp_path: Path):
    path = tmp_path / "a.mcap"
    none = np.zeros(3, dtype=np.int64)
    timing = Timing(np.arange(3), none, none, 3, 1_000_000, LoopOutcome.COMPLETE)
    with recording(path) as (recorder, control):
        control.say(PHASE, "identify")
        control.put(300)
        control.say("warning", "Größer als ½")
        report = recorder.finish(timing_message(0.3, timing, Rights(granted=["memory locked"])))
    assert report.recording_ok
    assert (report.acknowledged, report.waiting, report.lost, report.restarts) == (300, 0, 0, 0)
    found = read_recording(path)
    assert found.remark is None
    stored = rows(0, 300)
    stored["cdr_header"] = (0, 1, 0, 0)
    assert found.ticks.tobytes() == stored.tobytes()
    assert found.messages("/phase") == [{"t": 0.0, "name": "identify"}]
    assert found.messages("/event") == [{"t": 0.3, "kind": "warning", "text": "Größer als ½"}]
    end = found.last("/timing")
    assert (end["periods"], end["missed"], end["ticks_lost"], end["recorder_restarts"]) == (3, 0, 0, 0)
    assert sum(end["counts"]) == 3
    assert end["granted"] == ["memory locked"]
    assert found.settings["hashes"] == SETTINGS["hashes"]


def test_ticks_are_acknowledged_while_the_run_goes_on(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "100 ticks on disk")
        on_disk = read_recording(tmp_path / "a.mcap")
        assert on_disk.ticks["sequence"].tolist() == list(range(100))
        assert recorder.check().sync_us_max > 0.0


@pytest.mark.parametrize("kills", [4, pytest.param(100, marks=pytest.mark.slow)])
def test_no_acknowledged_tick_is_missing_or_repeated_after_kills_at_random_moments(kills: int):
    command = [sys.executable, KILLS, "--kills", str(kills), "--json"]
    found = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    assert (found["restarts"], found["acknowledged_and_missing"], found["lost"]) == (kills, 0, 0)
    assert found["recorded"] == found["put"] > 0


def test_a_recorder_that_hangs_is_replaced_and_no_tick_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    # Longer than the start of the second recorder on a busy computer, which would be replaced too.
    monkeypatch.setattr("exograv.runtime.recorder.recorder.HANGS_S", 2.0)
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "100 ticks on disk")
        os.kill(recorder.pid, signal.SIGSTOP)
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 200, "200 ticks on disk")
        report = recorder.check()
        assert (report.restarts, report.lost, report.why) == (1, 0, "")
    assert read_recording(path).ticks["sequence"].tolist() == list(range(200))


@pytest.mark.long
def test_a_recorder_that_hangs_before_it_completes_its_file_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("exograv.runtime.recorder.recorder.HANGS_S", 2.0)
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "100 ticks on disk")
        os.kill(recorder.pid, signal.SIGSTOP)  # no tick waits
        report = recorder.finish()
        assert report.restarts >= 1
        assert report.why == ""
    assert len(read_recording(path).ticks["sequence"]) == 100


def test_messages_to_a_recorder_that_stands_still_do_not_make_its_parent_wait(tmp_path: Path):
    path, count = tmp_path / "a.mcap", 3000
    with recording(path) as (recorder, control):
        control.put(100)
        os.kill(recorder.pid, signal.SIGSTOP)
        for number in range(count):  # far more than a pipe holds
            recorder.write("/control", 1e-3 * number, {"act": "publish", "x": 60 * [float(number)]})
        os.kill(recorder.pid, signal.SIGCONT)
    messages = read_recording(path).messages("/control")
    assert [message["x"][0] for message in messages] == [float(number) for number in range(count)]


def test_a_recorder_that_hangs_at_the_end_is_replaced_and_no_tick_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("exograv.runtime.recorder.recorder.HANGS_S", 0.5)
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "100 ticks on disk")
        os.kill(recorder.pid, signal.SIGSTOP)
        control.put(100)
        report = recorder.finish()
        assert (report.acknowledged, report.restarts, report.why) == (200, 1, "")
    assert read_recording(path).ticks["sequence"].tolist() == list(range(200))


def test_ticks_are_counted_also_while_the_ring_is_full(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        os.kill(recorder.pid, signal.SIGSTOP)
        control.put(RING_TICKS + 10)
        assert recorder.offered() == RING_TICKS + 10
        os.kill(recorder.pid, signal.SIGCONT)


@pytest.mark.long
def test_a_recorder_without_work_does_not_count_as_hanging(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.runtime.recorder.recorder.HANGS_S", 2.0)
    with recording(tmp_path / "a.mcap") as (recorder, control):
        for _ in range(5):
            control.put(10)
            wait_until(lambda: recorder.check().waiting == 0, "ticks on disk")
            time.sleep(0.5)
        assert recorder.check().restarts == 0


def test_events_are_there_once_after_the_recorder_was_killed(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        for k in range(3):
            control.say("note", str(k))
            control.put(5)
            wait_until(lambda k=k: recorder.check().acknowledged == 5 * (k + 1), "ticks on disk")
            os.kill(recorder.pid, signal.SIGKILL)
            wait_until(lambda: not recorder._child.is_alive, "its end")
        recorder.finish()
    assert [note["text"] for note in read_recording(tmp_path / "a.mcap").messages("/event")] == ["0", "1", "2"]


@pytest.mark.long
def test_states_of_the_guard_are_there_once_after_the_recorder_was_killed(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        for k in range(3):
            control.keep_guard(0.5 * k, [float(k), np.nan, -1.0])
            control.put(5)
            wait_until(lambda k=k: recorder.check().acknowledged == 5 * (k + 1), "ticks on disk")
            os.kill(recorder.pid, signal.SIGKILL)
            wait_until(lambda: not recorder._child.is_alive, "its end")
        recorder.finish()
    kept = read_recording(tmp_path / "a.mcap").messages("/guard")
    assert [(one["now"], one["persons"], one["version"]) for one in kept] == [
        (0.5 * k, 1, f"{VERSION:08x}") for k in range(3)
    ]
    np.testing.assert_array_equal([state_in(one) for one in kept], [[k, np.nan, -1.0] for k in range(3)])


@pytest.mark.parametrize(
    "topic", ["/task", *(pytest.param(topic, marks=pytest.mark.long) for topic in ("/page", "/control"))]
)
def test_messages_of_the_parent_are_there_once_after_the_recorder_was_killed(tmp_path: Path, topic: str):
    forms = {
        "/task": {"kind": "touch", "record": {"kind": "touch"}}, "/page": {"topic": "/act", "message": {}},
        "/control": {"act": "level", "gravity_level": 1.0, "ramp_s": 1.0},
    }  # fmt: skip
    with recording(tmp_path / "a.mcap") as (recorder, control):
        for k in range(3):
            recorder.write(topic, float(k), forms[topic])
            control.put(5)
            wait_until(lambda k=k: recorder.check().acknowledged == 5 * (k + 1), "ticks on disk")
            os.kill(recorder.pid, signal.SIGKILL)
            wait_until(lambda: not recorder._child.is_alive, "its end")
        recorder.finish()
    assert [message["t"] for message in read_recording(tmp_path / "a.mcap").messages(topic)] == [0.0, 1.0, 2.0]


def test_a_new_recorder_writes_within_five_seconds(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        control.put(5)
        wait_until(lambda: recorder.check().acknowledged == 5, "ticks on disk")
        os.kill(recorder.pid, signal.SIGKILL)
        killed = time.monotonic()
        control.put(5)
        wait_until(lambda: recorder.check().acknowledged == 10, "ticks on disk")
        assert time.monotonic() - killed < 5.0


def test_a_file_of_an_earlier_run_is_not_continued(tmp_path: Path):
    path = tmp_path / "a.mcap"
    for count in (50, 7):
        with recording(path) as (_, control):
            control.put(count)
    assert len(read_recording(path).ticks) == 7


def test_after_a_kill_of_the_parent_all_ticks_are_recorded_and_the_file_is_complete(tmp_path: Path):
    program = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "import numpy as np\n"
        "from exograv.recording.encoding import tick_dtype\n"
        "from exograv.runtime.recorder.recorder import Recorder\n"
        "if __name__ == '__main__':\n"
        "    recorder = Recorder(Path(sys.argv[1]), ('elbow',), {}, 1.0, 60.0)\n"
        "    ring = recorder.inlet.ticks()\n"
        "    for row in np.zeros(40, tick_dtype(1)):\n"
        "        ring.put(row)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    (tmp_path / "parent.py").write_text(program)
    path = tmp_path / "a.mcap"
    subprocess.run([sys.executable, tmp_path / "parent.py", path], capture_output=True, check=False)
    wait_until(lambda: path.exists() and read_recording(path).remark is None, "a complete file")
    assert len(read_recording(path).ticks) == 40


def test_ctrl_c_does_not_end_the_recorder(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        os.kill(recorder.pid, signal.SIGINT)
        control.put(10)
        wait_until(lambda: recorder.check().acknowledged == 10, "ticks on disk")
        assert recorder.check().restarts == 0


def test_a_full_disk_is_reported_within_a_second_and_does_not_delay_control(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "ticks on disk")
        file_size_limit(recorder.pid, path.stat().st_size + 100)
        control.put(200)
        full = time.monotonic()
        wait_until(lambda: not recorder.check().recording_ok, "an alarm")
        assert time.monotonic() - full < 1.0
        control.put(RING_TICKS)
        report = recorder.check()
        assert "cannot be written" in report.why
        assert "Free some space" in report.why
        assert report.acknowledged == 100
        assert report.restarts == 0
        assert report.lost == 200  # the ring is full of ticks that will never be safe
        assert np.percentile(control.put_us, 90) < PUT_US
        assert not recorder.finish().recording_ok
    found = read_recording(path)
    assert found.remark is not None
    assert found.ticks["sequence"].tolist() == list(range(100))


def _record_on_a_slow_disk(job: RecorderJob, parent: Connection) -> None:
    fast = os.fdatasync

    def slow(file: int) -> None:
        time.sleep(0.3)
        fast(file)

    os.fdatasync = slow
    record(job, parent)


@pytest.mark.long
def test_a_slow_disk_delays_no_process_and_loses_no_tick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.runtime.recorder.recorder.record", _record_on_a_slow_disk)
    with recording(tmp_path / "a.mcap") as (recorder, control):
        for _ in range(100):
            control.put(20)
            time.sleep(0.005)
        report = recorder.finish()
        put_us = control.put_us
    assert report.sync_us_max > 300_000.0
    assert (report.lost, report.acknowledged) == (0, 2000)
    assert np.percentile(put_us, 90) < PUT_US


def test_a_disk_that_hangs_is_reported_until_it_works_again(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        os.kill(recorder.pid, signal.SIGSTOP)
        control.put(TICKS_WAITING_MAX + 1)
        report = recorder.check()
        assert not report.recording_ok
        assert "wait for the disk" in report.why
        os.kill(recorder.pid, signal.SIGCONT)
        wait_until(lambda: recorder.check().recording_ok, "a recorder that has caught up")
        assert recorder.finish().lost == 0


def test_ticks_that_found_the_ring_full_are_counted_and_leave_a_gap(tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        os.kill(recorder.pid, signal.SIGSTOP)
        control.put(RING_TICKS + 30)
        os.kill(recorder.pid, signal.SIGCONT)
        wait_until(lambda: recorder.check().waiting == 0, "a recorder that has caught up")
        control.put(1)
        report = recorder.finish()
    assert report.lost == 30
    assert "30 ticks are missing" in report.why
    sequence = read_recording(tmp_path / "a.mcap").ticks["sequence"]
    assert np.diff(sequence).tolist()[-1] == 31


def _end_at_once(job: RecorderJob, parent: Connection) -> None:
    if job.start > 1:
        sys.exit(1)
    record(job, parent)


@pytest.mark.long
def test_a_recorder_that_ends_repeatedly_by_itself_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.runtime.recorder.recorder.record", _end_at_once)
    with recording(tmp_path / "a.mcap") as (recorder, _):
        os.kill(recorder.pid, signal.SIGKILL)
        wait_until(lambda: not recorder.check().recording_ok, "an alarm")
        report = recorder.check()
    assert "ended by themselves (exit code 1)" in report.why
    assert report.restarts == FRUITLESS_MAX


def test_an_alteration_of_the_file_under_a_killed_recorder_is_reported(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(100)
        wait_until(lambda: recorder.check().acknowledged == 100, "ticks on disk")
        os.kill(recorder.pid, signal.SIGKILL)
        wait_until(lambda: not recorder._child.is_alive, "its end")
        altered = path.read_bytes()[:-50]
        path.write_bytes(altered)
        wait_until(lambda: not recorder.check().recording_ok, "an alarm")
        assert "sound ticks, and 100 were on the disk before" in recorder.check().why
    assert path.read_bytes() == altered


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("/nothing", {}),
        ("/page", {"topic": "/a", "message": {"a": np.nan}}),
        ("/page", {"topic": "/a", "colour": "red"}),
    ],
)
def test_a_message_that_does_not_fit_is_refused_and_the_recording_goes_on(
    tmp_path: Path, topic: str, message: dict[str, object]
):
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, _):
        with pytest.raises(RecordingError):
            recorder.write(topic, 1.0, message)
        recorder.write("/event", 2.0, {"kind": "note", "text": "it goes on"})
        assert recorder.finish().recording_ok
    assert [each["text"] for each in read_recording(path).messages("/event")] == ["it goes on"]


def test_settings_that_are_not_in_the_table_are_refused_at_the_start(tmp_path: Path):
    with pytest.raises(RecordingError, match="unknown 'colour'"):
        Recorder(tmp_path / "a.mcap", JOINTS, {"colour": "red"}, RUN_S)


def test_a_run_that_would_not_fit_on_the_disk_is_refused_at_the_start(tmp_path: Path):
    with pytest.raises(RecordingError, match="MB are free"):
        Recorder(tmp_path / "a.mcap", JOINTS, SETTINGS, 1e9)


def test_another_program_can_read_the_file(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with recording(path) as (recorder, control):
        control.put(50)
        wait_until(lambda: recorder.check().acknowledged == 50, "ticks on disk")
        os.kill(recorder.pid, signal.SIGKILL)
        control.put(50)
    with path.open("rb") as stream:
        ticks = [message for _, _, message in make_reader(stream, validate_crcs=True).iter_messages("/tick")]
    assert [tick.log_time for tick in ticks] == [1_000_000 * k for k in range(100)]


@pytest.mark.parametrize("text", ["", "½" * 1000, "\x00\x00", "a\x00b"])
def test_any_text_fits_an_event(text: str):
    stored = event(1.0, "note", text)["text"].item().decode()
    assert len(stored.encode()) <= EVENT["text"].itemsize
    assert text.startswith(stored)


@pytest.mark.parametrize("t", [float("nan"), float("inf"), -1.0])
def test_a_clock_that_fails_does_not_stop_the_recorder(t: float, tmp_path: Path):
    with recording(tmp_path / "a.mcap") as (recorder, control):
        row = rows(0, 1)
        row["t"] = t
        control._ticks.put(row[0])
        control._events.put(event(t, "note", "x"))
        assert recorder.finish().recording_ok
    assert len(read_recording(tmp_path / "a.mcap").ticks) == 1


def test_a_recorder_that_starts_after_its_parent_gave_up_ends_without_a_traceback(tmp_path: Path):
    nowhere = Inlet(len(JOINTS), "no_ticks", "no_events", "no_guards")
    job = RecorderJob(tmp_path / "late.mcap", JOINTS, SETTINGS, nowhere, "no_status", 1, SYNC_S)
    with pytest.raises(SystemExit) as end:
        record(job, Mock(spec=Connection))
    assert end.value.code == GAVE_UP
