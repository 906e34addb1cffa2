"""A killed session ends with one command; its recording holds each acknowledged touch and each window once."""

import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import session_kills
from exograv.recording import read_recording
from session_kills import Session, faults_of, last_sentence, result_of, resume

SEED = 1014
PASSIVE, ACTIVE = "familiarisation", "training"


def killed(session: Session, kind: str, number: int, moment: str, *words: str) -> None:
    """Run the command until it kills itself."""
    command = [sys.executable, "-m", "tests.scenario.train_killed", kind, str(number), moment, *session.words, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr


def ends_whole(session: Session, acknowledged: set[tuple[str, int]]) -> list[str]:
    """Resume the session with one command; return what is wrong with its recording."""
    commands, _, wrong = resume(session)
    assert (commands, wrong) == (["train --resume"], [])
    recording = read_recording(session.recording)
    return faults_of(recording, acknowledged, result_of(session, recording))[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "number", "moment", "stage"),
    [
        ("phase_began", 1, "before", "preparation"),
        ("touch", 2, "after", "window 1"),
        ("window_closed", 1, "after", "rest 1"),
        ("window_closed", 2, "before", "window 2"),
        ("touch", 14, "before", "window 3"),
        ("phase_began", 7, "after", "last rest"),
        ("run_ended", 1, "after", "summary"),
        ("end", 1, "after", "after the end"),
    ],
)
def test_a_session_that_is_killed_at_any_moment_ends_with_one_command_and_loses_nothing(
    kind: str, number: int, moment: str, stage: str, tmp_path: Path
):
    session = Session(tmp_path / "session", PASSIVE, SEED)
    killed(session, kind, number, moment)
    assert session.stage() == stage
    assert not ends_whole(session, session.touches())


@pytest.mark.slow
def test_a_session_with_a_carried_arm_that_is_killed_twice_in_a_row_ends_with_one_command(tmp_path: Path):
    session = Session(tmp_path / "session", ACTIVE, SEED)
    killed(session, "touch", 2, "after")
    first = session.touches()
    process = session.start("--resume")
    size = session.recording.stat().st_size
    while process.poll() is None and session.recording.stat().st_size <= size:
        time.sleep(session_kills.POLL_S)  # until it lays the arm down, before a record
    process.kill()
    process.communicate()
    killed(session, "touch", 3, "after", "--resume")
    assert not ends_whole(session, first | session.touches())


@pytest.mark.slow
def test_a_session_whose_disk_is_full_ends_with_a_sentence_and_goes_on_when_there_is_space(tmp_path: Path):
    session = Session(tmp_path / "session", PASSIVE, SEED)
    process = session.start()
    _, said = session_kills.strike(session, process, "window 2", 0.0, "full disk")
    assert process.returncode == 1
    assert "P-07_short_01.mcap cannot be written" in said
    assert "Continue with the same command and --resume" in said
    assert not ends_whole(session, session.touches())


@pytest.mark.slow
def test_a_session_whose_disk_is_full_in_its_preparation_begins_again_with_the_same_command(tmp_path: Path):
    session = Session(tmp_path / "session", PASSIVE, SEED)
    process = session.start()
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (1000, 1000))
    said = last_sentence(process)
    assert "No window has begun. Begin again with the same command." in said
    assert not ends_whole(session, set())


@pytest.mark.slow
def test_a_new_session_does_not_replace_a_recording_with_windows_whose_checkpoint_is_gone(tmp_path: Path):
    session = Session(tmp_path / "session", PASSIVE, SEED)
    killed(session, "touch", 1, "after")
    session.checkpoint.unlink()
    before = session.recording.read_bytes()
    for words in ((), ("--resume",)):
        said = last_sentence(session.start(*words))
        assert "holds windows of this session, and its checkpoint is missing" in said
    assert session.recording.read_bytes() == before
