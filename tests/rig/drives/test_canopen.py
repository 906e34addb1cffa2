"""Properties of CANopen drives beyond the battery of every driver: frames, states, codes, and masters.

The drives' time advances with the SYNCs, so that a slow computer changes nothing, except where a process is killed.
"""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError, RigError
from exograv.model.description import load_rig
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.canopen import CanopenRig
from exograv.rig.drives.canopen.bus import Bus
from exograv.rig.drives.canopen.node import lost_after
from exograv.rig.drives.canopen.objects import CobId
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.signals import Command, JointState

HERE = Path(__file__).parent
EXAMPLE = (HERE.parents[2] / "examples" / "drives" / "canopen.toml").read_text(encoding="utf-8")
RIG = load_rig("recupera_like")
JOINTS = RIG.joints
ELBOW = JOINTS.index("elbow_flexion")
LOST_AFTER = lost_after(0.002)
PATIENCE_S = 0.5
"""Time-out for an answer of another process on a busy computer [s]."""


class Bench:
    """Commands to the process of the simulated drives."""

    def __init__(self, process: subprocess.Popen[str]):
        self._process = process
        self._line()

    def __call__(self, command: str) -> dict:
        """Execute a command; return the drives' state after it by their own report."""
        assert self._process.stdin is not None
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return json.loads(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, "the simulated drives have ended"
        return line


def settings(folder: Path, port: int, *changes: tuple[str, str], name: str = "drives") -> Path:
    """Write the example with a bus of its own."""
    text = EXAMPLE
    for old, new in (('"239.74.163.2"', f'"239.74.163.2:{port}"'), *changes):
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@contextmanager
def device(path: Path, *options: str) -> Iterator[Bench]:
    """Simulated drives in another process."""
    command = [sys.executable, str(HERE / "canopen" / "device.py"), str(path), *options]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Bench(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait(10.0)


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Drives, Bench]]:
    path = settings(tmp_path_factory.mktemp("can"), free_port())
    with device(path, "lock-step") as bench:
        yield load_drives(path, RIG), bench


@pytest.fixture
def bench(machine: tuple[Drives, Bench]) -> Iterator[Bench]:
    yield machine[1]
    for joint in JOINTS:
        machine[1](f"plug {joint}")
        machine[1](f"heat {joint} 25")
        machine[1](f"restart {joint}")


@pytest.fixture
def rig(machine: tuple[Drives, Bench], bench: Bench) -> Iterator[CanopenRig]:
    with CanopenRig(machine[0], PATIENCE_S) as one:
        yield one


def tell(rig: CanopenRig, state: JointState, current: float = 0.0, joint: int = ELBOW, damping: float = 0.0) -> None:
    """Command one joint, and zero for the others."""
    told, braking = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
    told[joint], braking[joint] = current, damping
    rig.write(Command(rig.t, state.sequence, rig.t + 0.01, told, told, braking))


def ticks(rig: CanopenRig, number: int, current: float = 0.0, joint: int = ELBOW) -> JointState:
    """Run `number` periods with the same command; return the last measurement."""
    state = rig.read()
    for _ in range(number - 1):
        tell(rig, state, current, joint)
        state = rig.read()
    tell(rig, state, current, joint)
    return state


def until_faulty(rig: CanopenRig, most: int) -> int:
    """Return the number of SYNCs until a joint is reported as faulty, while commands continue."""
    for k in range(1, most + 1):
        state = rig.read()
        if state.faulty:
            return k
        tell(rig, state)
    raise AssertionError(f"nothing was reported in {most} SYNCs")


@pytest.mark.parametrize("joint", range(4))
def test_positive_current_moves_a_joint_in_its_positive_direction_whatever_the_drives_sign_is(
    rig: CanopenRig, joint: int
):
    moved = {}
    for direction in (-1.0, 1.0):
        rig.enable()
        before = rig.read().q
        after = ticks(rig, 30, 3.0 * direction, joint)
        moved[direction] = after.q[joint] - before[joint]
        assert np.sign(after.current[joint]) == direction
        rig.disable()
    assert moved[1.0] > moved[-1.0] + 0.004


def test_what_the_drives_say_is_what_the_machine_is(rig: CanopenRig, bench: Bench, machine: tuple[Drives, Bench]):
    rig.enable()
    measured = ticks(rig, 1).q
    q = np.array(bench("state")["q"])  # after two steps of the twin
    np.testing.assert_allclose(measured, q, atol=0.01)
    state = rig.read()
    assert state.q_motor is not None
    np.testing.assert_allclose(state.q_motor, state.q, atol=0.03)


def test_measurements_count_the_syncs_and_carry_their_times(rig: CanopenRig):
    states = [rig.read() for _ in range(5)]
    assert np.diff([state.sequence for state in states]).tolist() == [1] * 4
    assert all(np.diff([state.t for state in states]) > 0.0)


def test_a_drive_brakes_with_what_its_command_says(rig: CanopenRig, bench: Bench):
    rig.enable()
    for _ in range(5):
        tell(rig, rig.read(), 0.0, damping=7.5)
    assert bench("state")["brakes"][ELBOW] == pytest.approx(7.5)


def test_a_drive_that_falls_silent_is_reported_and_the_others_are_still_measured(rig: CanopenRig, bench: Bench):
    rig.enable()
    ticks(rig, 5)
    bench("unplug elbow_flexion")
    assert until_faulty(rig, 10) == LOST_AFTER
    first, second = ticks(rig, 1), ticks(rig, 15)
    assert first.faulty == second.faulty == (ELBOW,)
    assert second.sequence == first.sequence + 15
    said = bench("state")
    assert said["fault"][ELBOW] == DriveFault.WATCHDOG
    assert said["enabled"] == [True, True, True, False]
    assert "has stopped answering" in rig.status()[ELBOW].sentence("elbow_flexion")


def test_while_an_answer_is_missing_no_measurement_is_made_up(rig: CanopenRig, bench: Bench):
    before = rig.read()
    bench("unplug elbow_flexion")
    assert rig.read() is before
    bench("plug elbow_flexion")
    after = rig.read()
    assert after.sequence == before.sequence + 2
    assert after.faulty == ()


def test_a_drive_that_has_restarted_does_nothing_before_somebody_enables_and_is_set_up_again(
    rig: CanopenRig, bench: Bench
):
    rig.enable()
    bench("unplug elbow_flexion")
    ticks(rig, 15)
    bench("plug elbow_flexion")
    bench("restart elbow_flexion")
    assert ticks(rig, 20, 1.0).faulty == (ELBOW,)
    assert bench("state")["enabled"] == [True, True, True, False]
    rig.enable()
    assert ticks(rig, 20, 1.0).current[ELBOW] == pytest.approx(1.0, abs=0.1)
    assert bench("state")["watchdog_s"][ELBOW] == 0.02


def test_a_drive_that_loses_its_power_for_a_moment_is_reported(rig: CanopenRig, bench: Bench):
    rig.enable()
    ticks(rig, 5)
    bench("restart elbow_flexion")
    assert until_faulty(rig, 10) < LOST_AFTER
    assert rig.read().faulty == (ELBOW,)


def test_enabling_without_a_drive_fails_with_its_name_and_leaves_all_off(rig: CanopenRig, bench: Bench):
    bench("unplug elbow_flexion")
    for _ in range(LOST_AFTER):
        rig.read()
    with pytest.raises(RigError, match=r"elbow_flexion \(node 4\) does not answer"):
        rig.enable()
    assert bench("state")["enabled"] == [False] * 4


FAULTS = {
    "TEMPERATURE": (0x4310, "is too hot"),
    "CURRENT": (0x2310, "overcurrent"),
    "ENCODER": (0x7305, "encoder fault"),
    "INTERNAL": (0x6100, "internal fault"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_an_emergency_is_a_fault_with_its_code_and_a_sentence(rig: CanopenRig, bench: Bench, fault: str):
    rig.enable()
    ticks(rig, 5)
    if fault == "TEMPERATURE":
        bench("heat elbow_flexion 111")
    else:
        bench(f"fail elbow_flexion {fault}")
    assert until_faulty(rig, 3) <= 2
    status = rig.status()[ELBOW]
    code, sentence = FAULTS[fault]
    assert (status.fault, status.code, status.is_enabled) == (DriveFault[fault], code, False)
    assert sentence in status.sentence("elbow_flexion")
    assert ticks(rig, 10, 1.0).faulty == (ELBOW,)


FOREIGN = {"SYNC": CobId.SYNC, "NMT": CobId.NMT, "command": CobId.COMMAND + 4, "question": CobId.QUESTION + 4}


@pytest.mark.parametrize("frame", FOREIGN)
def test_a_master_that_comes_later_is_a_fault_of_every_joint(
    machine: tuple[Drives, Bench], rig: CanopenRig, frame: str
):
    rig.enable()
    ticks(rig, 5)
    assert machine[0].settings.canopen is not None
    other = Bus(machine[0].settings.canopen)
    try:
        other.send(FOREIGN[frame], bytes([0x80, 0]) if frame == "NMT" else b"")
    finally:
        other.close()
    assert until_faulty(rig, 3) <= 2
    assert all(DriveFault.OTHER_MASTER in one.fault for one in rig.status())


def test_a_machine_that_is_left_is_off_and_without_fault(machine: tuple[Drives, Bench], bench: Bench):
    with CanopenRig(machine[0], PATIENCE_S) as rig:
        rig.enable()
        ticks(rig, 5, 1.0)
    said = bench("state")
    assert said["enabled"] == [False] * 4
    assert said["fault"] == [0] * 4
    assert said["operational"] == [False] * 4
    with pytest.raises(RigError, match="not open"):
        rig.read()


def test_an_exception_leaves_the_machine_off(machine: tuple[Drives, Bench], bench: Bench):
    def fly():
        with CanopenRig(machine[0], PATIENCE_S) as rig:
            rig.enable()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fly()
    assert bench("state")["enabled"] == [False] * 4


def test_a_drive_that_is_not_there_is_named_with_its_node(machine: tuple[Drives, Bench], bench: Bench, tmp_path: Path):
    assert machine[0].settings.canopen is not None
    port = int(machine[0].settings.canopen.channel.split(":")[1])
    path = settings(tmp_path, port, ("node = 4\n", "node = 5\n"))
    with pytest.raises(RigError, match=r"elbow_flexion \(node 5\)"):
        CanopenRig(load_drives(path, RIG), PATIENCE_S).__enter__()
    assert bench("state")["enabled"] == [False] * 4


def test_a_bus_that_needs_a_missing_package_or_adapter_says_which(tmp_path: Path):
    path = settings(tmp_path, 1, ('interface = "udp_multicast"', 'interface = "pigeon"'))
    with pytest.raises(ConfigError, match="pigeon"):
        CanopenRig(load_drives(path, RIG)).__enter__()


def test_a_drive_without_a_damping_of_its_own_goes_into_its_quick_stop_instead(tmp_path: Path):
    path = settings(tmp_path, free_port())
    with (
        device(path, "lock-step", "without=0x2100,0x2101,0x6007,0x1400") as bench,
        CanopenRig(load_drives(path, RIG), PATIENCE_S) as rig,
    ):
        assert sum("0x6007" in note for note in rig.notes) == 4
        assert sum("heartbeat only" in note for note in rig.notes) == 4
        rig.enable()
        ticks(rig, 5)
        tell(rig, rig.read(), damping=5.0)
        assert ticks(rig, 3).faulty == (ELBOW,)
        assert bench("state")["enabled"] == [True, True, True, False]
        for _ in range(15):
            rig.read()
        assert bench("state")["enabled"] == [False] * 4


@contextmanager
def master(path: Path) -> Iterator[subprocess.Popen[str]]:
    """Our own software in a process that may be killed, after it has enabled the machine."""
    command = [sys.executable, str(HERE / "canopen" / "master.py"), str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "on\n"
            yield process
        finally:
            process.kill()


@pytest.fixture(scope="module")
def living(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Bench]]:
    path = settings(tmp_path_factory.mktemp("can"), free_port(), ("watchdog_ms = 20.0", "watchdog_ms = 30.0"))
    with device(path) as bench:
        yield path, bench


@pytest.mark.slow  # in real time
def test_ctrl_c_switches_the_machine_off_and_leaves_no_node_waiting_for_us(living: tuple[Path, Bench]):
    path, bench = living
    with master(path) as process:
        process.send_signal(signal.SIGINT)
        process.wait(5.0)
        assert process.returncode != 0
        said = bench("state")
        assert said["enabled"] == [False] * 4
        assert said["operational"] == [False] * 4
