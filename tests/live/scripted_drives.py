"""Loops in Python and in C on the same inputs: clock, drives and control follow a script.

No time passes but by sleep and by waiting for a packet, so that both loops see the same times.
"""

import contextlib
import ctypes
import secrets
import struct
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing import Pipe
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from exograv.live.guard_job import GuardedRig, GuardJob, answer_by_ns
from exograv.live.guard_process import GuardLoop
from exograv.live.native import library
from exograv.live.native_buses import CANOPEN, UDP, NativeBus
from exograv.live.native_guard import NativeGuard
from exograv.model.description import load_rig
from exograv.recording.encoding import tick_dtype
from exograv.rig.drives.canopen.bus import Bus, CanFrame
from exograv.rig.drives.canopen.objects import CobId
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.canopen.states import ENABLE
from exograv.rig.drives.native.record import NOTHING, Now, Receive, Send, Sleep
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.rig.drives.udp.layout import DriveFlag, Type
from exograv.rig.drives.udp.packets import Header, decode, encode
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
)
from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, Guard
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native.library import Library
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable

JOINTS, DESCENT_S = 4, 0.05
EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
MODES = ("off", "exo_only", "floating")
SESSION, GRANT = 77, 99
GAIN = np.array([7.0, 6.5, 5.0, 4.0])

ANSWER, LOST, LATE, CORRUPT, TWICE, NOT_A_NUMBER, ABSENT, FAULT, OFF, NO_MOTOR = range(10)
"""Behaviour of the drives at one poll."""
SPEAK, SILENT, DAWDLE, NAN, HUGE, WRONG_NUMBER, WRONG_MODE, OPEN_LOOPS, DEAD, OTHER_MODE = range(10)
"""Behaviour of control in one tick."""


@dataclass
class Script:
    """Course of a run, by tick."""

    drives: np.ndarray
    control: np.ndarray
    overslept_ns: np.ndarray
    """Lateness of the tick [ns]."""
    q: np.ndarray
    tau: np.ndarray


def calm(ticks: int, seed: int = 0) -> Script:
    """Return a course without any fault: a slow motion, and torques that the guard allows."""
    rng, t = np.random.default_rng(seed), 1e-3 * np.arange(ticks)[:, None]
    rate = rng.uniform(0.5, 2.0, JOINTS)
    q = 0.3 * np.sin(rate * t) + 1e-5 * rng.standard_normal((ticks, JOINTS))
    tau = 2.0 * np.sin(rate * t + rng.uniform(0.0, 6.0, JOINTS)) * np.minimum(5.0 * t, 1.0)
    nothing = np.zeros(ticks, dtype=int)
    return Script(nothing, nothing.copy(), rng.integers(0, 200_000, ticks), q, tau)


def wild(ticks: int, seed: int, share: float) -> Script:
    """Return a course in which drives or control misbehave in some ticks."""
    script, rng = calm(ticks, seed), np.random.default_rng([seed, 1])
    script.drives = np.where(rng.random(ticks) < share, rng.integers(1, 10, ticks), ANSWER)
    script.drives[0] = ANSWER  # a machine that never answered does not open
    script.control = np.where(rng.random(ticks) < share, rng.integers(1, 10, ticks), SPEAK)
    script.overslept_ns = np.where(rng.random(ticks) < 0.3 * share, 4_000_000, script.overslept_ns)
    return script


@dataclass
class World(ABC):
    """Clock, bus, drives and control of one loop."""

    script: Script
    now: int = 5_000_000_000
    tick: int = 0
    sent: list[Any] = field(default_factory=list)
    arrivals: list[tuple[int, Any]] = field(default_factory=list)
    currents: np.ndarray = field(default_factory=lambda: np.zeros(JOINTS))
    control_looks: Callable[[], None] = lambda: None
    """Function that lets control look for a new state; of `Side`."""

    example: ClassVar[str]
    """File of these drives in `examples/drives`."""
    bus: ClassVar[NativeBus]

    def monotonic_ns(self) -> int:
        return self.now

    def monotonic(self) -> float:
        return self.now / 1e9

    def sleep(self, seconds: float) -> None:
        self.sleep_until(self.now + round(1e9 * seconds))

    def sleep_until(self, until_ns: int) -> None:
        self.now = max(self.now, until_ns)
        self.control_looks()

    def arriving(self, until_ns: int) -> Any:
        """Return the next packet or frame that arrives before `until_ns`; otherwise time passes until then."""
        if self.arrivals and self.arrivals[0][0] <= max(until_ns, self.now):
            at, data = self.arrivals.pop(0)
            self.now = max(self.now, at)
            return data
        self.now = max(self.now, until_ns)
        return None

    @abstractmethod
    def machine(self, drives: Drives) -> UdpRig | CanopenRig:
        """Return the machine of these drives, switched on."""

    @abstractmethod
    def sent_by_c(self, data: bytes) -> int:
        """Take what the loop in C sends."""

    @abstractmethod
    def received_by_c(self, until_ns: int) -> bytes | None:
        """Return what the loop in C receives."""


@dataclass
class UdpWorld(World):
    """Drives on UDP: they answer a poll after 50 µs."""

    number: int = 0
    command: int = 0
    example, bus = "udp.toml", UDP

    def machine(self, drives: Drives) -> UdpRig:
        rig = UdpRig(drives)
        link = rig._link
        link._socket, link._session, link._grant = FakeSocket(self), SESSION, GRANT  # type: ignore[assignment]
        rig.read()
        rig._is_on = True
        return rig

    def sent_by_c(self, data: bytes) -> int:
        return self.send(data)

    def received_by_c(self, until_ns: int) -> bytes | None:
        return self.arriving(until_ns)

    def send(self, data: bytes) -> int:
        """Take a packet of the loop."""
        self.sent.append(data)
        packet = decode(data)
        if packet.header.kind is Type.COMMAND:
            self.command, self.currents = packet.header.sequence, np.array(packet.joints[::2])
        elif packet.header.kind is Type.POLL:
            self._answer(packet.header)
        return len(data)

    def _answer(self, asked: Header) -> None:
        what, k = self.script.drives[self.tick], self.tick
        self.number += 1
        status, fault = DriveFlag.ENABLED | DriveFlag.PRESENT, 0
        joints = list[float]()
        for j in range(JOINTS):
            is_odd = j == 1
            q = float("nan") if what == NOT_A_NUMBER and is_odd else self.script.q[k, j]
            motor = float("nan") if what == NO_MOTOR else self.script.q[k, j] + 1e-4
            of_joint = DriveFlag.ENABLED if what == ABSENT and is_odd else status
            of_joint = DriveFlag.PRESENT if what == OFF and is_odd else of_joint
            fault = 4 if what == FAULT and is_odd else 0
            joints += [q, motor, self.currents[j], 30.0, int(of_joint), fault, 7 if fault else 0, 0]
        header = Header(Type.STATE, JOINTS, 0, SESSION, GRANT, self.number, asked.sequence, self.now)
        data = encode(header, (self.command, 0), tuple(joints))
        if what == CORRUPT:
            data = data[:50] + bytes([data[50] ^ 1]) + data[51:]
        if what != LOST:
            at = self.now + (1_000_000 if what == LATE else 50_000)
            self.arrivals += [(at, data)] * (2 if what == TWICE else 1)


CAN_FRAME = struct.Struct("<IBBBB8s")
"""Frame of SocketCAN."""
STATUS_ON, STATUS_OFF, STATUS_FAULT = 0x27, 0x40, 0x08
EMERGENCY_SHORT = struct.pack("<HB5x", 0x2310, 1)


class Wire(Bus):
    """CAN bus of a world."""

    def __init__(self, world: "CanWorld"):
        self._world, self.counts, self._mark = world, Counter(), None
        self.adapter: Any = type("Adapter", (), {"socket": type("Socket", (), {"fileno": lambda _: -1})()})

    def receive(self, until: float) -> CanFrame | None:
        return self._world.arriving(round(1e9 * until))

    def send(self, cob: int, data: bytes) -> None:
        self._world.take(cob, bytes(data))

    def close(self) -> None:
        pass


@dataclass
class CanWorld(World):
    """Drives on CAN: each answers a SYNC with two frames, 50 to 400 µs after it."""

    example, bus = "canopen.toml", CANOPEN

    def machine(self, drives: Drives) -> CanopenRig:
        rig = CanopenRig(drives)
        link = Wire(self)
        rig._link, rig._cycle = link, rig._cycle_on(link)
        self._per_count = (drives.sign * drives.rad_per_count).tolist()
        assert drives.rad_per_motor_count is not None
        self._per_motor_count = (drives.sign * drives.rad_per_motor_count).tolist()
        self._offset = drives.offset.tolist()
        for node in rig._nodes:
            node.is_wanted, node.control, node.has_damping = True, ENABLE, True
        rig.read()
        rig._is_on = True
        return rig

    def sent_by_c(self, data: bytes) -> int:
        cob, length, _, _, _, body = CAN_FRAME.unpack(data)
        self.take(cob, body[:length])
        return len(data)

    def received_by_c(self, until_ns: int) -> bytes | None:
        frame = self.arriving(until_ns)
        return None if frame is None else CAN_FRAME.pack(frame.cob, len(frame.data), 0, 0, 0, frame.data)

    def take(self, cob: int, data: bytes) -> None:
        """Take a frame of the loop."""
        self.sent.append((cob, data))
        if CobId.COMMAND < cob <= CobId.COMMAND + JOINTS:
            self.currents[cob - CobId.COMMAND - 1] = struct.unpack_from("<h", data, 2)[0]
        elif cob == CobId.SYNC:
            for joint in range(JOINTS):
                self._answer(joint)
            self.arrivals.sort(key=lambda one: one[0])

    def _answer(self, joint: int) -> None:
        what, k = self.script.drives[self.tick], self.tick
        is_odd, node = joint == 1, joint + 1
        word = STATUS_OFF if what == OFF and is_odd else STATUS_FAULT if what == FAULT and is_odd else STATUS_ON
        q = self.script.q[k, joint] - self._offset[joint]
        current = int(self.currents[joint]) if np.isfinite(self.currents[joint]) else 0
        body = struct.pack("<Hih", word, round(q / self._per_count[joint]), current)
        motor = struct.pack("<i", round((q + 1e-4) / self._per_motor_count[joint]))
        at = self.now + 50_000 + 90_000 * joint + (2_000_000 if what == LATE else 0)
        frames = [CanFrame(CobId.MEASURED + node, body), CanFrame(CobId.MOTOR + node, motor)]
        if what == CORRUPT:
            frames[0] = CanFrame(frames[0].cob, body[:5])
        if what == NO_MOTOR:
            frames = frames[:1]
        if what == FAULT and is_odd:
            frames.insert(0, CanFrame(CobId.EMERGENCY + node, EMERGENCY_SHORT))
        if what != LOST and not (what == ABSENT and is_odd):
            self.arrivals += [(at + 10_000 * n, frame) for n, frame in enumerate(frames)] * (2 if what == TWICE else 1)


class FakeSocket:
    """Socket of the Python driver in this world."""

    def __init__(self, world: UdpWorld):
        self._world = world

    def send(self, data: bytes) -> int:
        return self._world.send(data)

    def recv(self, _size: int) -> bytes:
        world = self._world
        if world.arrivals and world.arrivals[0][0] <= world.now:
            return world.arrivals.pop(0)[1]
        raise BlockingIOError

    def fileno(self) -> int:
        return -1

    def close(self) -> None:
        pass

    def select(self, _read: object, _write: object, _errors: object, seconds: float) -> tuple[list[int], None, None]:
        """Wait as `select.select`: time passes until the next packet, or until the time is over."""
        world, until = self._world, self._world.now + round(1e9 * seconds)
        comes = bool(world.arrivals) and world.arrivals[0][0] <= until
        world.now = max(world.now, world.arrivals[0][0] if comes else until)
        return ([1] if comes else []), None, None


@dataclass
class Side:
    """Loop in its world, and the memory that it shares with control and recorder."""

    world: World
    rig: UdpRig | CanopenRig
    guard: Guard
    job: GuardJob
    made: GuardedRig
    states: Mailbox
    answers: Mailbox
    ticks: Ring
    events: Ring
    guards: Ring
    lines: tuple[object, object]

    def __post_init__(self):
        self._row, self._seen, self._due = np.zeros((), answer_dtype(JOINTS)), 0, 0
        self._before = int(self.states.count)
        self.world.control_looks = self.look

    def look(self) -> None:
        """Let control answer a new state, as the script says."""
        world, got = self.world, self.states.read()
        if got is None:
            return
        if got[0] != self._seen:
            self._seen = got[0]
            slow = world.script.control[world.tick] == DAWDLE
            self._due = world.now + (9 * self.job.period_ns // 10 if slow else 0)
            self._state, self._is_answered = got[1], False
        if self._is_answered or world.now < self._due:
            return
        self._is_answered, what, row, k = True, world.script.control[world.tick], self._row, world.tick
        if what == SILENT:
            return
        row["sequence"] = self._state["sequence"] - (what == WRONG_NUMBER)
        row["valid_until"] = self._state["now"] + (-1.0 if what == DEAD else COMMAND_LIFE_S)
        row["mode"] = 99 if what == WRONG_MODE else min(k // 40, 2) if what != OTHER_MODE else 1
        row["slope"] = 0.5 if what == OPEN_LOOPS else 1e-9
        row["tau"] = world.script.tau[k]
        row["tau"][2] = {NAN: np.nan, HUGE: 1e9}.get(what, row["tau"][2])
        row["v"], row["q_reference"], row["tau_feedforward"] = 0.1 * k, np.nan, row["tau"] * 0.9
        row["findings"], row["seen"], row["gravity_level"] = k // 10, (1 << 40) + k, self._state["gravity_level"]
        row["drive"], row["arm_share"] = 0.0, 1.0
        self.answers.write(row)


def limits_of_person(level: float = 30.0) -> PersonLimits:
    """Return limits of a person whose arm weighs something."""
    exo, arm = np.zeros((JOINTS, 9)), np.zeros((JOINTS, 9))
    exo[:, 1], arm[:, 2] = 1.0, 2.0
    wide = np.full(JOINTS, level)
    # A chain of two joints has nine products.
    chains = tuple(LimbTable((a, b), 2, exo[[a, b]], arm[[a, b]]) for a, b in ((0, 1), (2, 3)))
    still = np.full(JOINTS, 0.5)
    return PersonLimits(PlausibleTable(chains, still, still, still), wide, np.full(JOINTS, -3.0), np.full(JOINTS, 3.0))


def _guard(native: Library | None, period_s: float) -> Guard:
    limits = Limits(np.full(JOINTS, 30.0), np.full(JOINTS, 10.0), descent_s=DESCENT_S)
    envelope = Envelope(limits, period_s, native)
    envelope.person = GuardedPerson(limits_of_person(), 0.4)
    return Guard.of_machine(envelope, period_s, GAIN.tolist())


@contextlib.contextmanager
def side(script: Script, native: Library | None, make: type[World], ticks: int = 10_000) -> Iterator[Side]:
    """Yield one machine whose drives are switched on, its guard, and shared memory."""
    world = make(script)
    drives = load_drives(EXAMPLES / world.example, load_rig("recupera_like"))
    with contextlib.ExitStack() as stack:
        use(world, stack.enter_context(pytest.MonkeyPatch.context()))
        rig = world.machine(drives)
        guard = _guard(native, drives.period_s)
        made = GuardedRig(rig, guard, GAIN)
        memory = [
            stack.enter_context(contextlib.closing(one))
            for one in (
                Mailbox(state_dtype(JOINTS)), Mailbox(answer_dtype(JOINTS)), Ring(tick_dtype(JOINTS), RING_TICKS),
                Ring(EVENT, RING_EVENTS), Ring(guard_dtype(JOINTS), RING_GUARDS),
            )
        ]  # fmt: skip
        states, answers, rows, events, guards = memory
        channels = Channels(JOINTS, states.name, answers.name, Inlet(JOINTS, rows.name, events.name, guards.name))
        job = GuardJob(lambda: made, channels, ticks, MODES, period_ns=round(1e9 * drives.period_s))
        yield Side(world, rig, guard, job, made, states, answers, rows, events, guards, Pipe())  # type: ignore[arg-type]


TIMED = (
    "exograv.rig.drives.clock", "exograv.rig.drives.driver", "exograv.rig.drives.udp.host",
    "exograv.rig.drives.udp.link", "exograv.rig.drives.cycle", "exograv.rig.drives.nodes_driver",
    "exograv.rig.drives.canopen.bus", "exograv.live.guard_process", "exograv.runtime.control_loop.guard_commands",
)  # fmt: skip
"""Modules of the Python loop that read the clock or sleep."""


def use(world: World, patch: pytest.MonkeyPatch) -> None:
    """Let the Python loop live in this world."""
    for module in TIMED:
        patch.setattr(f"{module}.time", world)
    if isinstance(world, UdpWorld):
        patch.setattr("exograv.rig.drives.udp.link.select", FakeSocket(world))
    patch.setattr(secrets, "randbelow", lambda _most: SESSION - 1)


class PythonSide:
    """The loop in Python."""

    def __init__(self, one: Side, patch: pytest.MonkeyPatch):
        self.side, self._patch = one, patch
        self.guarding = GuardLoop(one.job, one.lines[0], one.made)  # type: ignore[arg-type]

    def order(self, word: object) -> None:
        """Give a message of the parent, after the tick."""
        self.guarding.hearing.hear(word, self.side.rig.t)

    def run(self, period: int) -> bool:
        """Run one tick."""
        use(self.side.world, self._patch)
        return self.guarding.tick(period)

    def close(self) -> None:
        self.guarding.close()


class NativeSide:
    """The loop in C."""

    def __init__(self, one: Side):
        self.side, world = one, one.world
        assert library.LIBRARY is not None
        self.library = library.LIBRARY
        parent = one.lines[0]
        self.guarding = NativeGuard(one.job, parent, one.made, world.bus, self.library)  # type: ignore[arg-type]
        self.guarding.loop.answer_by_ns = answer_by_ns(one.job.period_ns)  # as long as the loop in Python waits

        def received(_drives: int, into: int, _size: int, until_ns: int) -> int:
            data = world.received_by_c(until_ns)
            if data is None:
                return NOTHING
            ctypes.memmove(into, data, len(data))
            return len(data)

        self._hooks = (
            Now(lambda _drives: world.now),
            Sleep(lambda _drives, until_ns: world.sleep_until(until_ns)),
            Send(lambda _drives, data, size: world.sent_by_c(ctypes.string_at(data, size))),
            Receive(received),
        )
        for name, hook in zip(("now_hook", "sleep_hook", "send_hook", "receive_hook"), self._hooks, strict=True):
            setattr(self.guarding.drives, name, ctypes.cast(hook, ctypes.c_void_p).value)
        self.guarding.hand_over()

    def order(self, word: object) -> None:
        """Give a message of the parent; the loop takes it at the end of the next tick."""
        self.guarding.order(word)
        while self.guarding._waiting:
            assert self.library.loop_order(self.guarding.loop, self.guarding._waiting.popleft())

    def run(self, period: int) -> bool:
        """Run one tick."""
        return bool(self.library.loop_tick(self.guarding.loop, period))

    def take_back(self) -> None:
        """Give the machine back to its driver in Python."""
        self.side.world.bus.take_back(self.side.rig, self.guarding.drives)

    def close(self) -> None:
        self.guarding.hear()
        self.guarding.close()
