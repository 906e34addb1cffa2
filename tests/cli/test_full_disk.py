"""A command that finds no room ends with one sentence, and what was there before is unchanged."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from exograv import cli
from exograv.model.description import robots_folder

ROOT = Path(__file__).parents[2]
RECORDING = ROOT / "examples" / "data" / "floating.mcap"
# Python 3.11 keeps a truncated .pyc file where there is no room for a whole one (-B: none is written).
LIMITED = """\
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv.pop(1)),) * 2)
from exograv.cli import main
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="Windows has no limit of file sizes")
@pytest.mark.parametrize(
    ("words", "name", "most_bytes"),
    [
        (("report", str(RECORDING), "--out"), "floating.html", 20_000),
        (("rigs", "--json"), "rigs.json", 500),
        (("view", str(RECORDING), "--no-browser", "--page"), "page.html", 20_000),
        (("rig", "new", str(robots_folder() / "recupera_like" / "right.urdf"), "--out"), "mine", 500),
        (("study", "init"), "", 10),
    ],
    ids=["report", "json", "page", "new rig", "study"],
)
def test_a_file_that_finds_no_room_is_one_sentence_and_the_old_one_stays(
    words: tuple[str, ...], name: str, most_bytes: int, tmp_path: Path
):
    out = tmp_path / "out"
    target = out / name if name in ("rigs.json", "page.html", "mine") else out
    out.mkdir()
    if "." in name:
        (out / name).write_text("{}")
    command = [sys.executable, "-B", "-c", LIMITED, str(most_bytes), *words, str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | {"COLUMNS": "500"})
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    said = [line for line in done.stderr.splitlines() if line.startswith("exograv: ")]
    assert len(said) == 1
    assert "cannot be" in said[0]
    assert "File too large" in said[0]
    if "." in name:
        assert (out / name).read_text() == "{}"
    if name == "mine":
        assert list(out.iterdir()) == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_no_room_where_no_command_expects_it_is_a_sentence_too(
    number: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def full() -> None:
        raise OSError(number, os.strerror(number), "somewhere/file")

    monkeypatch.setattr(cli, "_run_as_asked", full)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert said.startswith(f"exograv: somewhere/file cannot be written: {os.strerror(number)}.")
    assert "run the same command again" in said


def test_another_error_of_the_system_is_not_hidden(monkeypatch: pytest.MonkeyPatch):
    def broken() -> None:
        raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr(cli, "_run_as_asked", broken)
    with pytest.raises(OSError, match="Bad file descriptor"):
        cli.main()
