"""The reference peers for laboratories work with our driver, and give no torque without a command."""

import json
import random
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.udp import UdpRig

from .battery.driving import drive, told
from .conftest import DeviceProcess, drives_of, drives_on, start_device

ROOT = Path(__file__).parents[3]
PEERS = ROOT / "examples" / "udp_peer"
CURRENT = 0.5
PATIENT_S = 0.05
"""Time-out of our driver for an answer [s]: a busy test computer is not under test."""


@pytest.fixture(scope="module", params=["python", "c"])
def peer(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Drives, str]]:
    """Running peer, and the settings of a machine behind it."""
    folder = tmp_path_factory.mktemp(request.param)
    drives = drives_of(drives_on(folder, "udp"))
    assert drives.settings.udp is not None
    port = str(drives.settings.udp.port)
    if request.param == "python":
        command = [sys.executable, "-I", str(PEERS / "peer.py"), port]
    else:
        if shutil.which("gcc") is None:
            pytest.skip("no gcc")
        command = [str(folder / "peer"), port]
        subprocess.run(["gcc", "-std=c99", "-O2", str(PEERS / "peer.c"), "-lm", "-o", command[0]], check=True)
    device: DeviceProcess = start_device(command, "listening")
    yield drives, request.param
    device.end()


@pytest.fixture
def rig(peer: tuple[Drives, str]) -> Iterator[UdpRig]:
    """Rig whose sequences wrap within the test."""
    with UdpRig(peer[0], answer_s=PATIENT_S, first_sequence=2**32 - 20) as entered:
        yield entered


def test_its_nameplate_is_that_of_the_example_and_nothing_is_on(rig: UdpRig):
    assert not any(one.is_enabled for one in rig.status())
    assert rig.joints[3] == "elbow_flexion"


def enabled(rig: UdpRig) -> np.ndarray:
    """Currents shortly after enabling and the first commands. Retried after a stall of this computer."""
    for _ in range(10):
        rig.enable()
        state = drive(rig, 0.05, CURRENT, lambda state: bool((state.current != 0.0).all()))
        if not state.faulty:
            return state.current
    raise AssertionError("never on for 50 ms")


@pytest.mark.slow  # in real time
def test_it_gives_the_torque_that_it_is_told_and_none_when_disabled(rig: UdpRig):
    np.testing.assert_allclose(enabled(rig), CURRENT)
    rig.disable()
    state = drive(rig, 0.05, CURRENT)
    np.testing.assert_array_equal(state.current, 0.0)


@pytest.mark.slow  # in real time
def test_its_watchdog_brakes_and_only_enabling_gives_torque_again(rig: UdpRig):
    enabled(rig)
    time.sleep(0.05)  # no host sends commands
    state = drive(rig, 0.1, CURRENT)
    np.testing.assert_array_equal(state.current, 0.0)
    assert state.faulty == (0, 1, 2, 3)
    assert all(DriveFault.WATCHDOG in one.fault for one in rig.status())
    np.testing.assert_allclose(enabled(rig), CURRENT)


@pytest.mark.slow  # in real time
def test_a_command_dies_before_the_watchdog_when_its_life_is_over(rig: UdpRig):
    enabled(rig)
    state = rig.read()
    rig.write(told(rig, state, CURRENT, life_s=0.001))
    time.sleep(0.008)
    np.testing.assert_array_equal(rig.read().current, 0.0)


def test_garbage_from_elsewhere_does_not_disturb_it(peer: tuple[Drives, str], rig: UdpRig):
    udp, dice = peer[0].settings.udp, random.Random(3)
    assert udp is not None
    enabled(rig)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for _ in range(20):
            for _ in range(20):
                stranger.sendto(dice.randbytes(dice.randrange(1400)), (udp.host, udp.port))
            drive(rig, 0.002, CURRENT)
        stranger.setblocking(False)
        with pytest.raises(BlockingIOError):  # no answer came
            stranger.recv(2048)
    np.testing.assert_allclose(enabled(rig), CURRENT)


@pytest.mark.slow  # in real time
def test_who_stops_without_a_word_leaves_it_to_the_next_after_a_watchdogs_time(peer: tuple[Drives, str]):
    first = UdpRig(peer[0], answer_s=PATIENT_S)
    first._link.open()
    first._begin()
    enabled(first)
    with UdpRig(peer[0], answer_s=PATIENT_S) as second:  # retries for several watchdog times
        np.testing.assert_array_equal(drive(second, 0.05, CURRENT).current, 0.0)
        assert not any(one.is_enabled for one in second.status())
        seen = first._link.counts["late or lost states"]
        first._answer_s = 0.01
        first.read()
        assert first._link.counts["late or lost states"] == seen + 1
    first._link.close()


def test_where_nobody_listens_the_address_is_named(tmp_path: Path):
    drives = drives_of(drives_on(tmp_path, "udp"))
    assert drives.settings.udp is not None
    with pytest.raises(RigError, match=f"No controller answers at 127.0.0.1:{drives.settings.udp.port}"):
        UdpRig(drives).__enter__()


def test_twenty_thousand_wrong_packets_give_no_torque_and_no_measurement(tmp_path: Path):
    figures = tmp_path / "fuzz.json"
    command = [sys.executable, str(ROOT / "benchmarks" / "udp_fuzz.py"), "--packets", "20000", "--json", str(figures)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    rows = json.loads(figures.read_text(encoding="utf-8"))
    assert {"peer.py", "drive-sim", "our driver"} <= rows.keys()
    assert all(row["packets"] >= 20_000 for row in rows.values())
    assert min(row["steps_with_torque"] for name, row in rows.items() if name != "our driver") > 100
    assert rows["our driver"]["accepted"] > 100


@pytest.mark.slow  # in real time
def test_a_controller_that_has_restarted_is_found_again_by_enabling_and_by_nothing_else(tmp_path: Path):
    drives = drives_of(drives_on(tmp_path, "udp"))
    assert drives.settings.udp is not None
    command = [sys.executable, "-I", str(PEERS / "peer.py"), str(drives.settings.udp.port)]
    device = start_device(command, "listening")
    with UdpRig(drives, answer_s=PATIENT_S) as rig:
        enabled(rig)
        device.end()
        rig._answer_s = 0.001
        assert drive(rig, 0.05, CURRENT).faulty == (0, 1, 2, 3)
        device = start_device(command, "listening")
        rig._answer_s = PATIENT_S
        assert drive(rig, 0.005, CURRENT).faulty == (0, 1, 2, 3)  # the grant has changed
        np.testing.assert_allclose(enabled(rig), CURRENT)
    device.end()
