"""A command from the server is what `python -m exograv.cli` is: its own process, folder, environment and status."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.preloaded import Started, exograv, script

PROGRAM = """
import os, sys, threading
print(os.getpid(), os.getcwd(), sys.argv[1:], os.environ.get("OF_THE_TEST"), __name__)
threading.Thread(target=lambda: print("thread")).start()
os.environ["OF_THE_TEST"] = "changed"
"""


@pytest.mark.parametrize("words", [("rigs",), ("demo", "--level", "7"), ("nothing",), ("--version",)])
def test_output_and_status_are_those_of_a_python_process(words: tuple[str, ...], tmp_path: Path):
    command = [sys.executable, "-m", "exograv.cli", *words]
    alone = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    served = exograv(*words, folder=tmp_path)
    assert (served.returncode, served.stdout, served.stderr) == (alone.returncode, alone.stdout, alone.stderr)


def test_a_command_has_its_own_process_folder_words_and_environment(tmp_path: Path):
    path = tmp_path / "program.py"
    path.write_text(PROGRAM, encoding="utf-8")
    pids = set()
    for word in ("one", "two"):
        said = script(path, word, folder=tmp_path, environment={**os.environ, "OF_THE_TEST": word}).stdout
        pid, rest = said.split(None, 1)
        pids.add(int(pid))
        assert rest.splitlines() == [f"{tmp_path} ['{word}'] {word} __main__", "thread"]
    assert len(pids | {os.getpid()}) == 3


@pytest.mark.parametrize(
    ("program", "complaint"),
    [
        ("raise ValueError('broken')", "ValueError: broken"),
        ("import sys; sys.exit('a sentence')", "a sentence"),
        ("import os; os._exit(3)", "ended with 3"),
        ("import os; os.abort()", f"ended with -{int(signal.SIGABRT)}"),
    ],
)
def test_a_program_that_fails_fails_the_test(program: str, complaint: str, tmp_path: Path):
    path = tmp_path / "program.py"
    path.write_text(program, encoding="utf-8")
    with pytest.raises(AssertionError, match=complaint):
        script(path, folder=tmp_path)


def test_a_warning_is_an_error_where_the_environment_asks_for_it(tmp_path: Path):
    path = tmp_path / "program.py"
    path.write_text("import warnings; warnings.warn('old')", encoding="utf-8")
    script(path, folder=tmp_path)
    with pytest.raises(AssertionError, match="UserWarning: old"):
        script(path, folder=tmp_path, environment={**os.environ, "PYTHONWARNINGS": "error"})


def test_a_started_command_is_ended_by_its_signal_and_others_run_meanwhile(tmp_path: Path):
    beside = Started("aircraft", "--help")
    assert exograv("--version", folder=tmp_path).returncode == 0
    with beside.stdin, beside.stdout:
        assert "usage" in beside.stdout.read()
    assert beside.wait() == 0
    beside = Started("drive-sim", "udp", "--drives", str(Path("examples/drives/udp.toml").absolute()))
    with beside.stdin, beside.stdout:
        beside.kill()
        assert beside.wait() == -signal.SIGKILL
