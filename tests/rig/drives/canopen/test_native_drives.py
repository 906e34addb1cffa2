"""CANopen drives in C send the same frames and measure the same as the Python driver, whatever comes by the bus."""

import ctypes
import struct
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from exograv.live.native import library
from exograv.model.description import load_rig
from exograv.rig.drives.canopen.bus import NO_FRAME, Bus, CanFrame
from exograv.rig.drives.canopen.native import handover
from exograv.rig.drives.canopen.objects import CobId
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.canopen.states import ENABLE
from exograv.rig.drives.cycle import FRAMES_AT_ONCE
from exograv.rig.drives.native.record import NOTHING, Now, Receive, Send, Sleep
from exograv.rig.drives.settings import load_drives
from exograv.signals import Command

pytestmark = pytest.mark.skipif(library.LIBRARY is None, reason="needs the compiled loop")

EXAMPLE = Path(__file__).parents[4] / "examples" / "drives" / "canopen.toml"
TICKS, PERIOD_NS = 300, 2_000_000
LIFE_S = 0.005
CAN_FRAME = struct.Struct("<IBBBB8s")
REMOTE = 0x40000000
"""Flag of a remote frame on SocketCAN."""
STATUS_ON, STATUS_OFF, STATUS_FAULT = 0x27, 0x40, 0x08


@dataclass
class Wire(Bus):
    """Bus and clock of one host: frames arrive at their times, and time passes only while the host waits."""

    frames: list[tuple[int, CanFrame]]
    now: int = 5_000_000_000
    sent: list[tuple[int, bytes]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    _mark: str | None = None

    def monotonic(self) -> float:
        """Time for the Python driver [s]."""
        return self.now / 1e9

    def arriving(self, until_ns: int) -> CanFrame | None:
        """Return the next frame before `until_ns`; time passes until then."""
        if self.frames and self.frames[0][0] <= max(until_ns, self.now):
            at, frame = self.frames.pop(0)
            self.now = max(self.now, at)
            return frame
        self.now = max(self.now, until_ns)
        return None

    def receive(self, until: float) -> CanFrame | None:
        """Receive for the Python driver."""
        return self.arriving(round(1e9 * until))

    def send(self, cob: int, data: bytes) -> None:
        """Send a frame."""
        self.sent.append((cob, bytes(data)))

    def close(self) -> None:
        """Do nothing."""


def script(seed: int, share: float) -> list[tuple[int, CanFrame]]:
    """Draw the frames of a flight: answers that are late, lost, doubled, cut or in a fault, and those of strangers."""
    rng, frames = np.random.default_rng(seed), list[tuple[int, CanFrame]]()
    for tick in range(TICKS):
        begin = 5_000_000_000 + (tick + 1) * PERIOD_NS
        for node in range(1, 5):
            frames += answers(rng, share, begin, node) + asides(rng, share, begin, node)
        if rng.random() < 0.003 * share:
            frames.append((begin + 8_000, CanFrame(int(rng.choice([CobId.SYNC, CobId.NMT, CobId.COMMAND + 2])), b"")))
        if rng.random() < 0.02 * share:  # a flood, and our own echoes and broken frames among it
            strange = [CanFrame(0x7E0, b""), NO_FRAME]
            frames += [(begin + 100 * k, strange[int(rng.integers(2))]) for k in range(200)]
    return sorted(frames, key=lambda one: one[0])


def answers(rng: np.random.Generator, share: float, begin: int, node: int) -> list[tuple[int, CanFrame]]:
    word, found = STATUS_ON, list[tuple[int, CanFrame]]()
    if rng.random() < 0.1 * share:
        word = int(rng.choice([STATUS_OFF, STATUS_FAULT, 0x0F, 0x07, 0xFF]))
    answer = struct.pack("<Hih", word, int(rng.integers(-(2**31), 2**31)), int(rng.integers(-1000, 1000)))
    motor = struct.pack("<i", int(rng.integers(-(2**31), 2**31)))
    for cob, data in ((CobId.MEASURED, answer), (CobId.MOTOR, motor)):
        kind, at = rng.random(), begin + int(rng.integers(20_000, 900_000))
        if kind < 0.3 * share:
            continue
        late = int(rng.integers(0, 2 * PERIOD_NS)) if kind < 0.5 * share else 0
        cut = int(rng.integers(0, len(data))) if kind > 1.0 - 0.1 * share else len(data)
        found += [(at + late, CanFrame(cob + node, data[:cut]))] * (1 + int(kind > 1.0 - 0.2 * share))
    return found


def asides(rng: np.random.Generator, share: float, begin: int, node: int) -> list[tuple[int, CanFrame]]:
    """Draw temperatures, emergencies and heartbeats of a drive."""
    found = list[tuple[int, CanFrame]]()
    if rng.random() < 0.02:
        warm = struct.pack("<h", int(rng.integers(0, 900)))
        found.append((begin + 5_000, CanFrame(CobId.SLOW + node, warm)))
    if rng.random() < 0.02 * share:
        code = int(rng.choice([0x0000, 0x8140, 0x8130, 0x7305, 0x9000, 0x2310, 0x4210, 0x1000]))
        found.append((begin + 6_000, CanFrame(CobId.EMERGENCY + node, struct.pack("<HB5x", code, 1))))
    if rng.random() < 0.01 * share:
        found.append((begin + 7_000, CanFrame(CobId.HEARTBEAT + node, bytes([int(rng.choice([0, 5]))]))))
    return found


def opened(wire: Wire, damped: bool, patch: pytest.MonkeyPatch) -> CanopenRig:
    """Return a machine whose drives are on, at this wire."""
    rig = CanopenRig(load_drives(EXAMPLE, load_rig("recupera_like")))
    use(wire, patch)
    rig._clock._began = 5.0
    rig._link = wire
    rig._cycle = rig._cycle_on(wire)
    for node in rig._nodes:
        node.is_wanted, node.control, node.has_damping = True, ENABLE, damped
    rig._is_on = True
    return rig


def use(wire: Wire, patch: pytest.MonkeyPatch) -> None:
    for module in ("clock", "cycle", "driver", "nodes_driver", "canopen.bus"):
        patch.setattr(f"exograv.rig.drives.{module}.time", wire)


class InC:
    """The same machine in C, whose frames are those of SocketCAN."""

    def __init__(self, rig: CanopenRig, wire: Wire, patch: pytest.MonkeyPatch):
        patch.setattr(
            wire, "adapter", type("Adapter", (), {"socket": type("S", (), {"fileno": lambda _: -1})()}), False
        )
        self.rig, self.wire, self.record = rig, wire, handover.handed_over(rig)

        def sent(_drives: int, data: int, size: int) -> int:
            cob, length, _, _, _, body = CAN_FRAME.unpack(ctypes.string_at(data, size))
            wire.send(cob, body[:length])
            return size

        def received(_drives: int, into: int, _size: int, until_ns: int) -> int:
            frame = wire.arriving(until_ns)
            if frame is None:
                return NOTHING
            if frame is NO_FRAME:
                frame = CanFrame(0x181 | REMOTE, b"")
            ctypes.memmove(into, CAN_FRAME.pack(frame.cob, len(frame.data), 0, 0, 0, frame.data), CAN_FRAME.size)
            return CAN_FRAME.size

        self._hooks = Now(lambda _: wire.now), Sleep(lambda *_: None), Send(sent), Receive(received)
        for name, hook in zip(("now", "sleep", "send", "receive"), self._hooks, strict=True):
            setattr(self.record, f"{name}_hook", ctypes.cast(hook, ctypes.c_void_p).value)

    def read(self) -> None:
        assert library.LIBRARY is not None
        library.LIBRARY.can_read(ctypes.byref(self.record))

    def write(self, sequence: int, valid_until: float, current: np.ndarray, damping: np.ndarray) -> None:
        assert library.LIBRARY is not None
        addresses = (ctypes.c_void_p(one.ctypes.data) for one in (current, damping))
        library.LIBRARY.can_write(
            ctypes.byref(self.record), ctypes.c_int64(sequence), ctypes.c_double(valid_until), *addresses
        )


def test_a_flood_takes_a_bounded_number_of_frames_from_the_bus_and_no_time(monkeypatch: pytest.MonkeyPatch):
    begin = 5_000_000_000 + PERIOD_NS
    flood = [(begin, CanFrame(0x7E0, b""))] * 1000
    wires = Wire(list(flood), begin), Wire(list(flood), begin)
    python = opened(wires[0], True, monkeypatch)
    native = InC(opened(wires[1], True, monkeypatch), wires[1], monkeypatch)
    use(wires[0], monkeypatch)
    python.read()
    native.read()
    assert [len(wire.frames) for wire in wires] == [1000 - 2 * FRAMES_AT_ONCE] * 2
    assert [wire.now for wire in wires] == [begin] * 2


@pytest.mark.parametrize("damped", [True, False])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("seed", range(4))
def test_both_drivers_send_and_measure_the_same(seed: int, share: float, damped: bool, monkeypatch: pytest.MonkeyPatch):
    frames, rng = script(seed, share), np.random.default_rng(seed)
    wires = Wire(list(frames)), Wire(list(frames))
    python = opened(wires[0], damped, monkeypatch)
    native = InC(opened(wires[1], damped, monkeypatch), wires[1], monkeypatch)
    used = 0
    for tick in range(TICKS):
        for wire in wires:
            wire.now = max(wire.now, 5_000_000_000 + (tick + 1) * PERIOD_NS)
        use(wires[0], monkeypatch)
        state = python.read()
        native.read()
        current, damping = rng.uniform(-12.0, 12.0, 4), rng.choice([0.0, 0.0, 0.0, 3.3, 90.0], 4)
        now, life_s = python.t, LIFE_S if rng.random() < 0.95 else -LIFE_S
        python.write(Command(now, state.sequence, now + life_s, np.zeros(4), current, damping))
        native.write(state.sequence, now + life_s, current, damping)
        assert wires[0].sent == wires[1].sent, tick
        assert wires[0].now == wires[1].now, tick
        of_c = native.record
        assert (state.t, state.sequence) == (of_c.state_t, of_c.state_sequence), tick
        assert state.q.tolist() == of_c.q[:4] or np.isnan(state.q).all()
        assert state.current.tolist() == of_c.joint_current[:4] or np.isnan(state.current).all()
        assert sum(1 << joint for joint in state.faulty) == of_c.faulty, tick
        used = max(used, state.sequence)
    handover.take_back(native.rig, native.record)
    assert native.rig.counts == python.counts
    assert str(native.rig.status()) == str(python.status())  # a NaN equals no NaN, but their texts agree
    assert used > TICKS - 10 or share > 0.0
    assert len(wires[0].sent) > TICKS
