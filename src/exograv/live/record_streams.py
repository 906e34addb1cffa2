"""Recording of streams of other devices without a robot, by the listener and recorder of a live run."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import versions
from exograv.runtime.lsl.listening import ListenedStream, Listening
from exograv.runtime.recorder.recorder import Recorder

CHECK_S = 0.1
"""Period of the checks [s]."""


@dataclass(frozen=True)
class RecordedStreams:
    """Result of `exograv data streams --record`."""

    recording: Path
    recording_ok: bool
    recording_why: str
    recorder_restarts: int
    listener_restarts: int
    streams: list[ListenedStream]


def record_streams(wanted: Sequence[str], seconds: float, path: Path, progress: Progress) -> RecordedStreams:
    """Record streams for `seconds`, or until Ctrl-C.

    Args:
        wanted: Names or types of streams.
        seconds: Duration [s].
        path: File of the recording. Its clock is CLOCK_MONOTONIC of this computer.
        progress: Function that shows the progress.

    Raises:
        ConfigError: A stream is missing, or the duration is not allowed.
        RecordingError: The file cannot be written.
    """
    if not 0.0 < seconds <= 86_400.0:
        raise ConfigError(f"--seconds is {seconds:g}; allowed: above 0 and up to 86400 (one day).")
    progress("Looking for the streams", 0.0)
    settings = {"command": "exograv data streams", "versions": versions()}
    with (
        Listening(wanted) as listening,
        Recorder(path, (), settings, seconds, devices=listening.devices) as recorder,
    ):
        listening.begin(recorder.write)
        _watch(listening, recorder, seconds, progress)
        listening.finish()
        report = recorder.finish()
        why = report.why or report.unpublished
        return RecordedStreams(path, not why, why, report.restarts, listening.restarts, listening.figures())


def _watch(listening: Listening, recorder: Recorder, seconds: float, progress: Progress) -> None:
    begun = time.monotonic()
    try:
        while (passed := time.monotonic() - begun) < seconds:
            time.sleep(min(CHECK_S, seconds - passed))
            listening.check()
            recorder.check()
            progress("Recording", min(passed / seconds, 1.0))
    except KeyboardInterrupt:
        progress("Completing the recording", 1.0)
