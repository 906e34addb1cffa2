"""A machine is accepted with a dummy arm, and not with another dummy, without brakes, or after Ctrl-C.

The drives are simulated in another process, with the dummy in the cuffs. They wait for the computer.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.live.on_drives.test_flights_on_drives import LEVEL, SEED, Machine
from tests.live.on_drives.test_flights_on_drives import machine as machine

from exograv.live.on_drives.acceptance_command import IDENTIFY, ON_PURPOSE, WEIGH
from exograv.live.on_drives.acceptance_flights import AcceptanceFlights
from exograv.live.on_drives.connection import readiness_of
from exograv.live.options import AcceptOptions
from exograv.model.description import load_rig
from exograv.procedures.acceptance.dummy import SHIPPED, load_dummy
from exograv.procedures.acceptance.stops import STOPS
from exograv.rig.drives.settings import load_drives
from exograv.storage.acceptance_protocol import FILE, PAGE, AcceptanceProtocol
from exograv.storage.sealed_file import read_sealed

pytestmark = pytest.mark.slow

PARTS = [IDENTIFY, WEIGH, *(stop.title for stop in STOPS)]


def accept(machine: Machine, *words: str) -> tuple[int, str, AcceptanceProtocol]:
    """Run an acceptance with a fresh pass of the self-test; return exit status, output and protocol."""
    shutil.copy(machine.folder / "pass.toml", machine.folder / "out" / "self_test.toml")
    process = machine.exograv("rig", "accept", *words)
    return process.returncode, process.stdout, read_sealed(machine.folder / "out" / FILE, AcceptanceProtocol, "", "")


def failed(protocol: AcceptanceProtocol) -> list[str]:
    return [step.name for part in protocol.parts for step in part.steps if not step.passed]


def test_a_machine_with_the_dummy_of_its_file_is_accepted_and_then_locked(machine: Machine):
    status, said, protocol = accept(machine, "--by", "ab")
    assert status == 0, said
    assert [part.name for part in protocol.parts] == PARTS
    assert (protocol.done.state, protocol.done.by, failed(protocol)) == ("passed", "ab", [])
    assert "SIMULATED" in (machine.folder / "out" / PAGE).read_text(encoding="utf-8")
    figures = json.loads((machine.folder / "figures.json").read_text(encoding="utf-8"))
    assert figures["ok"]
    assert ON_PURPOSE in (machine.folder / "out" / "self_test.toml").read_text(encoding="utf-8")


def test_a_dummy_with_a_forearm_ten_percent_lighter_than_its_file_fails_at_the_comparison_only(
    machine: Machine, tmp_path: Path
):
    text = SHIPPED.read_text(encoding="utf-8")
    for part in load_dummy().parts_of("forearm"):
        before = f'segment = "forearm"\nmass_kg = {part.mass_kg:.3f}'
        assert before in text
        text = text.replace(before, f'segment = "forearm"\nmass_kg = {1.1 * part.mass_kg:.4f}', 1)
    (tmp_path / "dummy.toml").write_text(text, encoding="utf-8")
    dummies = ("--dummy", str(tmp_path / "dummy.toml"), "--simulated-dummy", str(SHIPPED))
    status, said, protocol = accept(machine, *dummies)
    assert status == 1, said
    assert (protocol.done.state, [part.name for part in protocol.parts]) == ("failed", [IDENTIFY])
    assert failed(protocol)
    assert all("against the known dummy" in name for name in failed(protocol))


def test_a_machine_whose_drives_do_not_brake_fails_at_the_hardware_stop(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
):
    """The dummy of the first test is identified already."""
    monkeypatch.chdir(machine.folder)
    text = Path("udp.toml").read_text(encoding="utf-8")
    free, count = re.subn(r"brake_Nms_per_rad = [\d.]+", "brake_Nms_per_rad = 0.0", text)
    assert count == 4
    Path("free.toml").write_text(free, encoding="utf-8")
    shutil.copy("pass.toml", "out/self_test.toml")
    options = AcceptOptions(simulate=True, drives=Path("free.toml"), level=LEVEL, seed=SEED)
    description, folder = load_rig(options.rig), Path("out")
    drives = load_drives(Path("free.toml"), description)
    readiness = readiness_of(options, folder, description, drives)
    flights = AcceptanceFlights(options, folder, readiness, load_dummy(), lambda *_: None, lambda _: None)
    steps = flights.stopped(next(stop for stop in STOPS if stop.name == "hardware"))
    assert [step.name for step in steps if not step.passed] == ["hardware stop: hand at most"]


def test_ctrl_c_leaves_a_sealed_protocol_that_says_aborted_and_names_the_part(machine: Machine):
    shutil.copy(machine.folder / "pass.toml", machine.folder / "out" / "self_test.toml")
    words = [sys.executable, "-c", ACCEPTANCE, *machine_words()]
    said = ""
    with subprocess.Popen(
        words, cwd=machine.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said += line
            if "Floating live," in line and said.count("Floating live,") == 1:
                os.killpg(process.pid, signal.SIGINT)
    protocol = read_sealed(machine.folder / "out" / FILE, AcceptanceProtocol, "", "")
    assert process.returncode == 128 + signal.SIGINT, said
    assert (protocol.done.state, protocol.done.aborted_at, protocol.parts) == ("aborted", IDENTIFY, [])
    assert "--resume" in said
    assert "Traceback" not in said


ACCEPTANCE = """\
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background lets its children ignore it
from exograv.cli import main
sys.argv = ["exograv", "rig", "accept", *sys.argv[1:]]
main()
"""


def machine_words() -> list[str]:
    """Options of the fixture's machine."""
    return ["--simulate", "--drives", "udp.toml", "--level", str(LEVEL), "--seed", str(SEED)]
