"""Ctrl-C at any point of a write leaves a complete recording, and is not lost."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from exograv.recording import RecordingWriter, read_recording
from exograv.recording.container import ChunkedFile


@pytest.fixture
def _listening() -> Iterator[None]:
    """Python's own handler of Ctrl-C: a shell in the background lets its children ignore the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("_listening")
@pytest.mark.parametrize("number", range(1, 5))
def test_an_interrupt_during_a_write_comes_after_it_and_the_file_stays_complete(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path, written = tmp_path / "run.mcap", [0]
    write = ChunkedFile._write

    def interrupted(file: ChunkedFile, data: bytes) -> int:
        size = write(file, data)
        written[0] += 1
        if written[0] == number:
            os.kill(os.getpid(), signal.SIGINT)
        return size

    def record() -> None:
        with RecordingWriter(path, ("elbow",), {}) as recording:
            monkeypatch.setattr(ChunkedFile, "_write", interrupted)
            for t, name in ((0.0, "move"), (1.0, "float")):
                recording.phase(t, name)
                recording.sync()

    with pytest.raises(KeyboardInterrupt):
        record()
    read = read_recording(path)
    assert read.remark is None
    assert read.messages("/phase")[0]["name"] == "move"
