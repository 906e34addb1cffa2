"""All modules but the live loop import and run on Windows and macOS; `exograv run live` refuses with a sentence."""

import os
import sys
from pathlib import Path

import pytest
from tests.preloaded import script

from exograv.errors import ConfigError, RigError
from exograv.live.options import LiveOptions
from exograv.loop.keyboard import is_line_typed
from exograv.rig.drives.moteus.fdcanusb import Fdcanusb
from exograv.runtime.clock.host import read_host
from exograv.runtime.clock.realtime import realtime

MISSING = {"win32": ["fcntl", "termios", "tty", "pty", "resource", "grp", "pwd"], "darwin": []}
"""Modules of the standard library that the system lacks."""

MISSING_NAMES = {
    "win32": ["getuid", "register_at_fork", "openpty", "ttyname", "sysconf", "getloadavg", "nice"],
    "darwin": [],
}
"""Functions of `os` that the system lacks, besides those of Linux's scheduler."""

ONLY_POSIX = ("exograv.rig.drives.moteus.serial_port",)

IMPORT_ALL = """
import importlib, os, pkgutil, signal, sys

def import_all(left_out=()):
    import exograv

    for module in pkgutil.walk_packages(exograv.__path__, "exograv."):
        if module.name not in left_out and not module.name.endswith("__main__"):
            importlib.import_module(module.name)

import_all()  # so that only our own modules see the other system
for name in [name for name in sys.modules if name.split(".")[0] == "exograv"]:
    del sys.modules[name]
for name in {missing}:
    sys.modules[name] = None
for name in [name for name in vars(os) if name.startswith("sched_")] + {missing_names}:
    delattr(os, name)
if {platform!r} == "win32":
    for name in ("SIGKILL", "SIGSTOP", "SIGCONT", "SIGXCPU"):
        delattr(signal, name)
sys.platform = {platform!r}
import_all({left_out})
"""


@pytest.mark.parametrize("platform", ["win32", pytest.param("darwin", marks=pytest.mark.long)])
def test_every_module_imports(platform: str, tmp_path: Path):
    program = IMPORT_ALL.format(
        platform=platform,
        missing=MISSING[platform],
        missing_names=MISSING_NAMES[platform],
        left_out=ONLY_POSIX if platform == "win32" else (),
    )
    path = tmp_path / "import_all.py"
    path.write_text(program, encoding="utf-8")
    script(path)


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_live_refuses_and_names_the_system(platform: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "platform", platform)
    with pytest.raises(ConfigError, match=f"needs Linux, and this is {platform}"):
        LiveOptions()


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_a_loop_without_linux_gets_no_rights_and_says_so(platform: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.delattr(os, "sched_getaffinity")
    with realtime(0) as rights:
        assert not rights.is_fifo
        assert not rights.is_locked
        assert platform in rights.refused[0]
    assert read_host(Path("/nowhere")).cpus == tuple(range(os.cpu_count() or 1))


def test_windows_refuses_a_moteus_adapter_with_a_sentence(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(RigError, match="not on Windows"):
        Fdcanusb("COM3")


@pytest.mark.parametrize("platform", ["win32", "linux"])
def test_a_typed_line_is_taken_once(platform: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "platform", platform)
    reading, writing = os.pipe()
    with os.fdopen(reading, "r") as answers:
        assert not is_line_typed(answers, 0.0)
        os.write(writing, b"\n")
        assert is_line_typed(answers, 5.0)
        assert not is_line_typed(answers, 0.0)
        os.close(writing)
