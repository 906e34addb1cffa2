"""An interrupted example is marked as unfinished, and the same command completes it without doing anything twice."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.study.made_up_sessions import settings, write_session
from tests.terminal import CTRL_C, in_terminal
from tests.waiting import wait_until

from exograv.campaigns.study_example import example_study
from exograv.campaigns.study_example.example_study import ExampleParticipant, make_example
from exograv.campaigns.study_example.options import ExampleOptions
from exograv.cli.study.showing import show_status
from exograv.errors import ConfigError, RecordingError
from exograv.report.study_report.chapters import Content, notices
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.status import study_status
from exograv.study.folder.study_folder import UNFINISHED, StudyFolder

SEED = 1001
OPTIONS = ExampleOptions((2, 1), (1, 1), SEED)
WAIT_S = 300.0


def told(_text: str, _share: float) -> None:
    pass


class Sessions:
    """Simulation of the sessions of a participant in milliseconds; it is interrupted before a participant."""

    def __init__(self) -> None:
        self.done = list[str]()
        self.interrupted_at = -1
        self.interruption: BaseException = KeyboardInterrupt()

    def __call__(self, somebody: ExampleParticipant, _tell: object, folder: Path) -> Iterator[list[Path]]:
        paths = list[Path]()
        for protocol, number in somebody.files:
            said = settings(somebody.code, protocol, number, command="exograv study example --simulate")
            paths.append(write_session(folder / f"{somebody.code}_{protocol}_{number:02d}.mcap", said))
            if len(self.done) == self.interrupted_at:
                raise self.interruption
        self.done.append(somebody.code)
        yield paths


@pytest.fixture
def sessions(monkeypatch: pytest.MonkeyPatch) -> Sessions:
    one = Sessions()
    monkeypatch.setattr(example_study, "_sessions_of", one)
    return one


def content(path: Path) -> dict[str, bytes]:
    """Return all files but the log, which has times of day."""
    files = (one for one in path.rglob("*") if one.is_file() and one.name not in ("log.jsonl", ".lock"))
    return {one.relative_to(path).as_posix(): one.read_bytes() for one in files}


def interrupted(path: Path, sessions: Sessions) -> StudyFolder:
    sessions.interrupted_at = 1
    with pytest.raises(KeyboardInterrupt):
        make_example(OPTIONS, path, told, workers=1)
    sessions.interrupted_at = -1
    return StudyFolder(path)


def test_a_continued_example_is_byte_for_byte_the_uninterrupted_one(tmp_path: Path, sessions: Sessions):
    make_example(OPTIONS, tmp_path / "whole", told, workers=1)
    everybody = list(sessions.done)
    sessions.done.clear()
    interrupted(tmp_path / "again", sessions)
    make_example(OPTIONS, tmp_path / "again", told, workers=1)
    assert sessions.done == everybody, "each participant once: the first one before the interruption"
    assert content(tmp_path / "again") == content(tmp_path / "whole")


def test_an_interrupted_example_says_so_until_it_is_complete(
    tmp_path: Path, sessions: Sessions, capsys: pytest.CaptureFixture[str]
):
    folder = interrupted(tmp_path / "study", sessions)
    status = study_status(folder)
    assert status.is_unfinished
    show_status(status)
    assert "This study is unfinished" in capsys.readouterr().out
    make_example(OPTIONS, folder.path, told, workers=1)
    assert not study_status(folder).is_unfinished


def test_the_report_of_an_unfinished_study_begins_with_a_notice():
    content = object.__new__(Content)  # without the data of a study, of which the notice says nothing
    object.__setattr__(content, "is_unfinished", True)
    first = next(iter(notices(content)))
    assert getattr(first, "text", None) == UNFINISHED


def test_a_participant_whose_sessions_are_only_partly_added_is_completed(
    tmp_path: Path, sessions: Sessions, monkeypatch: pytest.MonkeyPatch
):
    make_example(OPTIONS, tmp_path / "whole", told, workers=1)

    def add_one(folder: StudyFolder, paths: list[Path], options: Any) -> list[Any]:
        add_files(folder, paths[:1], options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(example_study, "add_files", add_one)
        with pytest.raises(KeyboardInterrupt):
            make_example(OPTIONS, tmp_path / "again", told, workers=1)
    make_example(OPTIONS, tmp_path / "again", told, workers=1)
    assert content(tmp_path / "again") == content(tmp_path / "whole")


def test_a_full_disk_is_told_with_the_advice_that_the_same_command_continues(tmp_path: Path, sessions: Sessions):
    sessions.interruption = RecordingError("The disk is full.")
    sessions.interrupted_at = 1
    with pytest.raises(RecordingError, match=r"The disk is full\. The sessions .* the same command continues"):
        make_example(OPTIONS, tmp_path / "again", told, workers=1)
    sessions.interrupted_at = -1
    make_example(OPTIONS, tmp_path / "again", told, workers=1)
    make_example(OPTIONS, tmp_path / "whole", told, workers=1)
    assert content(tmp_path / "again") == content(tmp_path / "whole")


def test_other_options_do_not_continue_an_example(tmp_path: Path, sessions: Sessions):
    folder = interrupted(tmp_path / "study", sessions)
    with pytest.raises(ConfigError, match=f"seed {SEED}, and this command has 7"):
        make_example(ExampleOptions((2, 1), (1, 1), 7), folder.path, told, workers=1)


def test_a_command_that_is_stopped_while_the_study_is_created_leaves_nothing(
    tmp_path: Path, sessions: Sessions, monkeypatch: pytest.MonkeyPatch
):
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(example_study, "new_participant", stopped)
        with pytest.raises(KeyboardInterrupt):
            make_example(OPTIONS, tmp_path / "study", told, workers=1)
    assert not (tmp_path / "study").exists()
    make_example(OPTIONS, tmp_path / "study", told, workers=1)
    assert [one.name for one in tmp_path.iterdir()] == ["study"]


@pytest.mark.slow
def test_a_killed_example_is_continued_by_the_same_command(tmp_path: Path):
    command = [sys.executable, "-m", "exograv.cli", "study", "example", "--seed", str(SEED)]
    command += ["--participants", "2,1", "--sessions", "0,0", "--out"]
    folder = StudyFolder(tmp_path / "again")
    with subprocess.Popen([*command, str(folder.path)], stderr=subprocess.DEVNULL) as process:
        try:
            wait_until(lambda: list(folder.sources.glob("*/*/source.json")), "the first session", WAIT_S)
        finally:
            process.kill()
    before = {path: path.stat().st_mtime_ns for path in folder.sources.glob("*/*/source.json")}
    assert folder.is_unfinished
    for path in (folder.path, tmp_path / "whole"):
        subprocess.run([*command, str(path)], check=True, capture_output=True)
    assert before.items() <= {path: path.stat().st_mtime_ns for path in before}.items()
    assert content(folder.path) == content(tmp_path / "whole")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows has no such terminals")
def test_the_key_ctrl_c_in_a_terminal_leaves_an_unfinished_study_that_the_same_command_completes(tmp_path: Path):
    folder = StudyFolder(tmp_path / "study")
    words = ["study", "example", "--seed", str(SEED), "--participants", "2,1", "--sessions", "0,0"]
    words += ["--out", str(folder.path)]
    with in_terminal(words, tmp_path) as run:
        wait_until(lambda: list(folder.sources.glob("*/*/source.json")), lambda: run.text, WAIT_S)
        run.press(CTRL_C)
        status = run.end(WAIT_S)
    assert status == 128 + signal.SIGINT, run.text
    assert "Traceback" not in run.text
    assert UNFINISHED in run.text
    before = {path: path.stat().st_mtime_ns for path in folder.sources.glob("*/*/source.json")}
    assert folder.is_unfinished
    with in_terminal(["study", "status", str(folder.path)], tmp_path) as run:
        assert run.end(WAIT_S) == 0
    assert "This study is unfinished" in run.text
    with in_terminal(words, tmp_path) as run:
        assert run.end(WAIT_S) == 0, run.text
    assert not folder.is_unfinished
    assert before.items() <= {path: path.stat().st_mtime_ns for path in before}.items(), "nothing is made twice"
