"""Run of a protocol in a recording."""

from pathlib import Path

from exograv.errors import RecordingError
from exograv.recording import open_recording
from exograv.task.record_sinks import TASK_TOPIC


def has_window(path: Path) -> bool:
    """Return True if the recording holds a window of a run."""
    try:
        recording = open_recording(path)
    except RecordingError:
        return False  # a command that ends at once leaves a file without settings
    return any(message["kind"] == "window_opened" for message in recording.messages(TASK_TOPIC))
