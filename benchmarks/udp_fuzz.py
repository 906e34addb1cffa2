"""Fuzz test of every program that speaks docs/reference/udp_protocol.md.

    python benchmarks/udp_fuzz.py --packets 1000000

Packets are seeded: noise, flipped bits, cut, grown, replayed and forged packets with right check sums, between those
of two ordinary hosts. They go to both reference peers (C under the address and undefined-behaviour sanitizers) and to
the simulated controller. Forged states go to our own driver. An oracle that shares no code with them (udp_oracle.py)
says which currents are allowed. Afterwards an ordinary session must work.
"""

import argparse
import importlib.util
import json
import os
import random
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

from udp_attack import FRIEND, Attack, Host, sealed
from udp_oracle import Oracle, word

HERE = Path(__file__).parent
ROOT = HERE.parent
PEERS = ROOT / "examples" / "udp_peer"
STEP_US = 1000
REMEMBERED = 64
"""Number of past polls whose answers our driver still accepts."""

GROWTH_MB = 8.0
"""Allowed growth of memory in a run; keeping all packets would take 300 MB."""


class Device(Protocol):
    """Interface of a program under attack."""

    name: str
    exact: bool

    def packet(self, data: bytes, address: int, now: int) -> bytes:
        """Take a packet; return the answer."""
        ...

    def step(self, now: int) -> tuple[float, ...]:
        """Let a period pass; return the currents [A]."""
        ...

    def memory_mb(self) -> float:
        """Resident memory of the device's process [MB]."""
        ...


def memory_mb(process: int | str = "self") -> float:
    """Resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class PythonPeer:
    """Device of examples/udp_peer/peer.py in this process."""

    name, exact = "peer.py", True

    def __init__(self):
        specification = importlib.util.spec_from_file_location("peer", PEERS / "peer.py")
        assert specification is not None
        assert specification.loader is not None
        peer = importlib.util.module_from_spec(specification)
        specification.loader.exec_module(peer)
        self._controller = peer.Controller()

    def packet(self, data: bytes, address: int, now: int) -> bytes:
        """Take a packet, as in `Device`."""
        return self._controller.receive(data, ("peer", address), 1e-6 * now) or b""

    def step(self, now: int) -> tuple[float, ...]:
        """Let a period pass, as in `Device`."""
        self._controller.step(1e-6 * now)
        return tuple(motor.current for motor in self._controller.motors)

    def memory_mb(self) -> float:
        """Resident memory, as in `Device` [MB]."""
        return memory_mb()


class CPeer:
    """Device of examples/udp_peer/peer.c in its own process; packets and times go through a pipe."""

    name, exact = "peer.c", True

    def __init__(self, folder: Path):
        program = folder / "pipe"
        flags = ["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-pedantic"]
        checks = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
        build = ["gcc", *flags, str(HERE / "udp_pipe.c"), "-lm", "-o", str(program)]
        if subprocess.run([*build, *checks], capture_output=True, check=False).returncode:
            self.name = "peer.c (no sanitizer here)"
            subprocess.run(build, check=True)
        # The sanitizer keeps freed blocks to find their use. A small quarantine lets growth of the peer itself show.
        environment = os.environ | {"ASAN_OPTIONS": "quarantine_size_mb=1"}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen([program], stdin=pipe, stdout=pipe, env=environment)

    def packet(self, data: bytes, address: int, now: int) -> bytes:
        """Take a packet, as in `Device`."""
        self._say(struct.pack("<qIHH", now, address, 1, len(data)) + data)
        return self._hear(int.from_bytes(self._hear(2), "little"))

    def step(self, now: int) -> tuple[float, ...]:
        """Let a period pass, as in `Device`."""
        self._say(struct.pack("<qIHH", now, 0, 0, 0xFFFF))
        return struct.unpack("<8f", self._hear(32))[:4]

    def memory_mb(self) -> float:
        """Resident memory, as in `Device` [MB]."""
        return memory_mb(self._process.pid)

    def end(self) -> None:
        """Close the pipe; the process must end without a fault.

        Raises:
            AssertionError: The process ended with a fault.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        if self._process.wait() != 0:
            raise AssertionError("the C peer ended with an error")

    def _say(self, data: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(data)
        self._process.stdin.flush()

    def _hear(self, size: int) -> bytes:
        assert self._process.stdout is not None
        data = self._process.stdout.read(size)
        if len(data) != size:
            raise AssertionError(f"the C peer died, with code {self._process.wait()}")
        return data


def free_drives() -> Any:
    """Return the example's drives at a free port."""
    from exograv.model.description import load_rig
    from exograv.rig.drives.settings import UdpBus, load_drives
    from exograv.rig.drives.simulated.address import free_port

    drives = load_drives(ROOT / "examples" / "drives" / "udp.toml", load_rig("recupera_like"))
    return replace(drives, settings=drives.settings.model_copy(update={"udp": UdpBus(port=free_port())}))


class Simulated:
    """Controller of `exograv dev drive-sim udp` in this process; nothing moves behind its drives."""

    name, exact = "drive-sim", False

    def __init__(self):
        from exograv.rig.drives.simulated.firmware import SimulatedDrive
        from exograv.rig.drives.udp.simulated.controller import UdpController

        drives = free_drives()
        self._plant = SimpleNamespace(
            each=[SimulatedDrive(one, drives.watchdog_s) for one in drives.each],
            now=0.0,
            measured=SimpleNamespace(q_motor=None),
            position=lambda joint: 0.0,
            current=lambda joint: 0.0,
            sample=lambda joint: 0,
        )
        plant: Any = self._plant
        self._controller = UdpController(plant, drives, say=lambda line: None)

    def packet(self, data: bytes, address: int, now: int) -> bytes:
        """Take a packet, as in `Device`."""
        self._plant.now = 1e-6 * now
        return self._controller.receive(data, ("peer", address), 1e-6 * now) or b""

    def step(self, now: int) -> tuple[float, ...]:
        """Let a period pass, as in `Device`."""
        self._plant.now = 1e-6 * now
        return tuple(drive.step(1e-6 * STEP_US, 1e-6 * now).current for drive in self._plant.each)

    def memory_mb(self) -> float:
        """Resident memory, as in `Device` [MB]."""
        return memory_mb()


def attack(device: Device, packets: int, seed: int) -> dict[str, Any]:
    """Send `packets` packets to one device; return the figures.

    Raises:
        ForbiddenError: The device did something that no valid packet asked for.
    """
    attacker, oracle, now, begun = Attack(seed), Oracle(device.exact), STEP_US, time.perf_counter()
    stepped, before = now, 0.0
    for k in range(packets):
        now += attacker.dice.choice((0, 1, 20, 150, 400))
        if attacker.dice.random() < 0.002:
            now += attacker.dice.choice((5_000, 19_000, 21_000, 60_000))
        while stepped + STEP_US <= now:
            stepped += STEP_US
            oracle.step(stepped, device.step(stepped))
        data, address, host = attacker.next(now)
        answer = device.packet(data, address, now)
        oracle.packet(data, address, now, answer)
        if host is not None:
            host.hear(answer)
        if k == packets // 5:
            before = device.memory_mb()
    grown = device.memory_mb() - before
    torque = work_as_ever(device, oracle, now)
    if grown > GROWTH_MB:
        raise AssertionError(f"{device.name} has grown by {grown:.1f} MB")
    return {
        "packets": packets,
        "accepted": oracle.accepted,
        "steps_with_torque": torque,
        "grown_MB": round(grown, 2),
        "seconds": round(time.perf_counter() - begun, 1),
    }


def work_as_ever(device: Device, oracle: Oracle, now: int) -> int:
    """Run an ordinary session after the attack; return the number of steps with torque before it.

    Raises:
        AssertionError: The session gives no torque.
    """
    before, host = oracle.steps_with_torque, Host(FRIEND, random.Random(7))
    now = (now // STEP_US + 60) * STEP_US
    for _ in range(40):
        for _ in range(2):
            data = host.next(now)
            answer = device.packet(data, FRIEND, now)
            oracle.packet(data, FRIEND, now, answer)
            host.hear(answer)
        now += STEP_US
        oracle.step(now, device.step(now))
    if oracle.steps_with_torque - before < 10:
        raise AssertionError(f"{device.name} gives no torque in an ordinary session after the attack")
    return before


def attack_driver(packets: int, seed: int) -> dict[str, Any]:
    """Send forged states to our own driver, between true ones; only a true state may become a measurement.

    Raises:
        AssertionError: A forged state became a measurement, or ordinary measurements stopped.
    """
    from exograv.rig.drives.udp import UdpRig

    drives, begun = free_drives(), time.perf_counter()
    address = drives.settings.udp.host, drives.settings.udp.port
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as controller:
        controller.bind(address)
        rig = UdpRig(drives, answer_s=0.05 * drives.period_s)
        attacker, true = _Forger(seed, rig, controller, drives), 0
        before = 0.0
        while attacker.sent < packets:
            true += attacker.round()
            if before == 0.0 and attacker.sent > packets // 5:
                before = memory_mb()
        grown = memory_mb() - before
        rig._link.close()
    if grown > GROWTH_MB:
        raise AssertionError(f"our driver has grown by {grown:.1f} MB")
    return {
        "packets": attacker.sent,
        "accepted": true,
        "refused": rig.counts,
        "grown_MB": round(grown, 2),
        "seconds": round(time.perf_counter() - begun, 1),
    }


class _Forger:
    """Forger in place of the controller; it knows the driver's next query."""

    AT_ONCE = 20

    def __init__(self, seed: int, rig: Any, controller: socket.socket, drives: Any):
        self._attack, self._rig, self._controller = Attack(seed), rig, controller
        self._link, self.sent, self._sequence = rig._link, 0, 0
        self._link.open()
        self._host = self._link._socket.getsockname()
        self._link._session, self._link._grant = 4711, 815
        self._values = self._attack.dice

    def round(self) -> bool:
        """Send forged states, in most rounds with a true one, then `read`; return True if the true one was accepted."""
        rig, dice = self._rig, self._values
        asked, forged = (self._link._sequence + 1) % 2**32, []
        self._sequence += dice.choice((1, 2, 3))
        position = dice.uniform(-1.0, 1.0)
        true = self._state(asked, position)
        for _ in range(self.AT_ONCE - 1):
            data = self._attack._kinds[dice.randrange(7)](true)
            if data != true and not _is_believable(data, asked):
                forged.append(data)
        has_true = dice.random() < 0.8
        if has_true:
            forged.insert(dice.randrange(len(forged)), true)
        for data in forged:
            self._controller.sendto(data, self._host)
        self.sent += len(forged)
        before = rig._state
        state = rig.read()
        if state.sequence != before.sequence and abs(state.q[0] - position) > 1e-12:
            raise AssertionError("a forged state became a measurement")
        if state.sequence != before.sequence and not has_true:
            raise AssertionError("a measurement without a true state")
        self._drain()
        return state.sequence != before.sequence

    def _state(self, asked: int, position: float) -> bytes:
        header = struct.pack("<BBBBIIIIQ", 1, 4, 4, 0, 4711, 815, self._sequence % 2**32, asked, 0)
        joint = struct.pack("<ddffHHHH", position, position, 0.5, 25.0, 3, 0, 0, 0)
        return sealed(b"EXGV" + header + struct.pack("<II", 0, 0) + 4 * joint)

    def _drain(self) -> None:
        """Empty both sockets: packets from our driver, and packets that the driver left unread."""
        for made in (self._controller, self._link._socket):
            made.setblocking(False)
            while True:
                try:
                    made.recv(2048)
                except BlockingIOError:
                    break


def _is_believable(data: bytes, asked: int) -> bool:
    """Return True if forged data answer a recent poll of our session with a right check sum: such a state is true."""
    if len(data) != 172 or data[:7] != b"EXGV\x01\x04\x04" or word(data, 168) != zlib.crc32(data[:-4]):
        return False
    return (word(data, 8), word(data, 12)) == (4711, 815) and (asked - word(data, 20)) % 2**32 < REMEMBERED


def main() -> None:
    """Attack all devices; print the figures, and write them as JSON with --json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--packets", type=int, default=20_000, help="packets for each device")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--only", nargs="+", choices=("python", "c", "drive-sim", "driver"), default=None)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    wanted = options.only or ["python", "drive-sim", "driver", *(["c"] if shutil.which("gcc") else [])]
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        if "python" in wanted:
            figures["peer.py"] = attack(PythonPeer(), options.packets, options.seed)
        if "c" in wanted:
            peer = CPeer(Path(folder))
            figures[peer.name] = attack(peer, options.packets, options.seed)
            peer.end()
    if "drive-sim" in wanted:
        figures["drive-sim"] = attack(Simulated(), options.packets, options.seed)
    if "driver" in wanted:
        figures["our driver"] = attack_driver(options.packets, options.seed)
    for name, row in figures.items():
        print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in row.items()))
    if options.json is not None:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
