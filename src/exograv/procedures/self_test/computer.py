"""Self-test of the computer: disk, clock, recorder and timing of the loop."""

import os
import signal
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from exograv.loop.pilot import Progress
from exograv.recording import read_recording
from exograv.recording.disk import refuse_small_disk
from exograv.recording.encoding import tick_dtype
from exograv.runtime.clock.fitness import SELF_TEST_S, WOKEN_SHARE_MIN, WOKEN_WITHIN_NS
from exograv.runtime.recorder.recorder import Recorder
from exograv.storage.self_test_step import Step, within

from .loop_timing import loop_test

TRIAL_S = 3600.0
"""Duration of a session [s]. The disk must have room for twice of it."""

READINGS = 10_000
KILL_TICKS = 200  # before and after the recorder is killed
RESTART_MAX_S = 5.0  # docs/explanation/safety.md, F18
LOOK_S = 0.02


def disk(folder: Path, joints: int) -> list[Step]:
    """Check that the disk has room for twice a session."""
    refuse_small_disk(folder / "session.mcap", joints, TRIAL_S)
    return [Step("disk", True, "room for twice a session", f"2 × {TRIAL_S:g} s")]


def clock() -> list[Step]:
    """Check that the clock of the loop never goes back."""
    info = time.get_clock_info("monotonic")
    readings = np.array([time.monotonic_ns() for _ in range(READINGS)])
    back = float(-np.diff(readings).min(initial=0))
    wrong = "The computer's monotonic clock goes back, or can be set. Use another computer."
    if not info.monotonic or info.adjustable:
        return [Step("clock is monotonic", False, info.implementation, "monotonic", "", wrong)]
    return [within("clock goes back", max(back, 0.0), 0.0, "ns", wrong)]


def recorder(folder: Path, joints: Sequence[str]) -> list[Step]:
    """Kill the recorder during a recording: another one must take over without loss.

    Raises:
        RecordingError: The recorder cannot start.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        path = Path(place) / "self_test.mcap"
        with Recorder(path, joints, {"command": "self-test"}, 1.0) as writer:
            ring, row = writer.inlet.ticks(), np.zeros((), tick_dtype(len(joints)))
            row["cdr_header"] = (0, 1, 0, 0)
            try:
                _put(ring, row, 0)
                os.kill(writer.pid, getattr(signal, "SIGKILL", signal.SIGTERM))  # on Windows every signal ends it
                killed = time.monotonic()
                _put(ring, row, KILL_TICKS)
                while writer.check().acknowledged < 2 * KILL_TICKS and time.monotonic() - killed < RESTART_MAX_S:
                    time.sleep(LOOK_S)
                took_s = time.monotonic() - killed
                report = writer.finish()
            finally:
                ring.close()
        kept = len(read_recording(path).ticks["t"])
    lost = "The recorder loses ticks when it is killed. Check the disk of --out, then install exograv again."
    slow = "A killed recorder is replaced too slowly. The computer or its disk is too slow or too busy."
    return [
        within(
            "ticks lost when the recorder is killed",
            float(2 * KILL_TICKS - min(kept, report.acknowledged)),
            0.0,
            "",
            lost,
        ),
        within("recorder is back after", took_s, RESTART_MAX_S, "s", slow),
    ]


def _put(ring, row: np.ndarray, first: int) -> None:
    for k in range(first, first + KILL_TICKS):
        row["t"], row["sequence"] = 1e-3 * k, k
        ring.put(row)


def timing(progress: Progress) -> list[Step]:
    """Measure the loop for ten seconds with real-time rights.

    A failure locks a real machine, but is no fault of the machine.
    """
    found = loop_test(2.0 * SELF_TEST_S, progress).figures
    row, may = found.rows[1], found.may_drive_worn
    reasons = " ".join([*found.reasons, *found.prepare])
    return [
        Step(
            f"ticks within {WOKEN_WITHIN_NS // 1000} µs, for {SELF_TEST_S:g} s",
            may,
            f"{100 * row.woken_share:.2f} %, {row.missed} missed",
            f"{100 * WOKEN_SHARE_MIN:g} %, 0 missed",
            "",
            "" if may else f"This computer may not drive a worn machine. {reasons}",
            locks_only=True,
        )
    ]
