"""Frames in C have the bytes of python-can on SocketCAN and on multicast, and a broken datagram is never a frame."""

import ctypes
import os
import socket
import struct
import threading

import can
import numpy as np
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame
from can.interfaces.udp_multicast.utils import pack_message, unpack_message

from exograv.live.native import library
from exograv.model.description import load_rig
from exograv.rig.drives.canopen.native.handover import runs_in_c
from exograv.rig.drives.canopen.native.record import COUNTS, CanDrives, Link
from exograv.rig.drives.canopen.objects import CobId
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.native.record import Receive, Send
from exograv.rig.drives.settings import load_drives

from .test_native_drives import EXAMPLE

pytestmark = pytest.mark.skipif(library.LIBRARY is None, reason="needs the compiled loop")

MARK = "0123abcd"
NO_FRAME = -1, b""
NOT_SENT, NOT_HEARD = (COUNTS.index(name) for name in ("not sent", "not heard"))


class Message(ctypes.Structure):
    _fields_ = [("cob", ctypes.c_int64), ("size", ctypes.c_int64), ("data", ctypes.c_uint8 * 8)]


def hooked(link: Link) -> CanDrives:
    """Return a machine with one drive, number 1."""
    drives = CanDrives(link=link, beat_every=1, joints=1)
    drives.mark[:] = MARK.encode()
    drives.each[0].node, drives.each[0].lost_after = 1, 3
    return drives


def call(name: str, *arguments: object) -> int:
    assert library.LIBRARY is not None
    return getattr(library.LIBRARY, name)(*arguments)


def taken_by_c(drives: CanDrives, data: bytes) -> tuple[int, bytes] | None:
    """Return the frame that C finds in a datagram, at a time when no further one is awaited; None for a broken one."""
    message = Message()

    def received(_machine: int, into: int, size: int, _until_ns: int) -> int:
        ctypes.memmove(into, data, min(len(data), size))
        return min(len(data), size)

    hook = Receive(received)
    drives.receive_hook = ctypes.cast(hook, ctypes.c_void_p).value
    found = call("can_receive", ctypes.byref(drives), ctypes.byref(message), ctypes.c_int64(0))
    return (message.cob, bytes(message.data[: message.size])) if found else None


def taken_by_python(data: bytes) -> tuple[int, bytes] | None:
    """Return the frame that python-can and `Bus` find in a datagram; None for one that python-can refuses."""
    try:
        one = unpack_message(data, replace={"timestamp": 1.0}, check=True)
    except Exception:  # noqa: BLE001 - python-can itself catches everything here
        return None
    if one.is_error_frame or one.is_remote_frame or one.is_extended_id or one.is_fd or one.channel == MARK:
        return NO_FRAME
    return one.arbitration_id, bytes(one.data)


def messages() -> list[can.Message]:
    """Return messages of all kinds that python-can sends."""
    kinds = [{}, {"is_extended_id": True}, {"is_remote_frame": True, "data": b""}, {"is_error_frame": True}]
    kinds += [{"is_fd": True, "bitrate_switch": True, "data": bytes(48)}, {"channel": "vcan0"}, {"channel": MARK}]
    kinds += [{"channel": "c" * 40}, {"arbitration_id": 5}, {"arbitration_id": 200}, {"timestamp": 12.5}]
    kinds += [{"is_extended_id": True, "arbitration_id": 0x1234567}, {"is_fd": True, "error_state_indicator": True}]
    plain = {"arbitration_id": 0x181, "data": bytes(range(8)), "is_extended_id": False, "check": True}
    return [can.Message(**{**plain, **kind}) for kind in kinds]


@pytest.mark.parametrize("one", messages(), ids=str)
def test_each_message_of_python_can_is_the_same_frame_in_c(one: can.Message):
    drives, data = hooked(Link.MULTICAST), pack_message(one)
    expected = taken_by_python(data)
    assert expected is not None
    assert taken_by_c(drives, data) == expected
    assert drives.counts[NOT_HEARD] == 0


@pytest.mark.parametrize("seed", range(6))
def test_a_changed_datagram_is_no_frame_in_c_that_it_is_not_in_python(seed: int):
    rng, drives = np.random.default_rng(seed), hooked(Link.MULTICAST)
    originals, broken = [pack_message(one) for one in messages()], 0
    for _ in range(2000):
        data = bytearray(originals[rng.integers(len(originals))])
        for _ in range(rng.integers(1, 4)):
            data[rng.integers(len(data))] = rng.choice([int(rng.integers(256)), 0xC0, 0xC2, 0xC3, 0xFF, 0x00, 0x7F])
        changed = bytes(data[: rng.integers(len(data) + 1)] if rng.random() < 0.2 else data)
        found = taken_by_c(drives, changed)
        broken += found is None
        assert found is None or found == taken_by_python(changed), changed
    assert drives.counts[NOT_HEARD] == broken
    assert 200 < broken < 2000


def sent_by_c(drives: CanDrives, cob: int, data: bytes) -> bytes:
    """Return the datagram of a frame that C sends."""
    sent = list[bytes]()

    def send(_machine: int, place: int, size: int) -> int:
        sent.append(ctypes.string_at(place, size))
        return size

    hook = Send(send)
    drives.send_hook = ctypes.cast(hook, ctypes.c_void_p).value
    call("can_send", ctypes.byref(drives), ctypes.c_int64(cob), data, ctypes.c_int64(len(data)))
    [datagram] = sent
    return datagram


@pytest.mark.parametrize("size", range(9))
@pytest.mark.parametrize("cob", [0x000, 0x080, 0x201, 0x77F])
def test_a_frame_has_the_bytes_of_python_can(cob: int, size: int):
    data = bytes(range(1, size + 1))
    plain = can.Message(arbitration_id=cob, data=data, is_extended_id=False, channel=MARK)
    assert sent_by_c(hooked(Link.MULTICAST), cob, data) == pack_message(plain)
    expected = build_can_frame(plain)
    drives = hooked(Link.SOCKETCAN)
    # python-can writes the size a second time, into a byte that the kernel reads only if it is 9 to 15.
    assert sent_by_c(drives, cob, data) == expected[:7] + b"\0" + expected[8:]
    assert taken_by_c(drives, expected) == (cob, data)


@pytest.mark.parametrize("flag", [0x80000000, 0x40000000, 0x20000000], ids=["29 bit", "remote", "error"])
def test_a_frame_of_socketcan_with_a_flag_means_nothing(flag: int):
    found = taken_by_c(hooked(Link.SOCKETCAN), struct.pack("=IB3x8s", 0x181 | flag, 8, bytes(8)))
    assert found is not None
    assert found[0] == -1


@pytest.mark.parametrize("data", [b"", bytes(15), bytes(17), bytes(72), struct.pack("=IB3x8s", 0x181, 9, bytes(8))])
def test_a_datagram_that_is_no_frame_of_socketcan_is_counted(data: bytes):
    drives = hooked(Link.SOCKETCAN)
    assert taken_by_c(drives, data) is None
    assert drives.counts[NOT_HEARD] == 1


def answering(bus: socket.socket, answers: list[bytes | None]) -> threading.Thread:
    """Return a running drive, which answers one SYNC after the other."""

    def serve() -> None:
        bus.settimeout(5.0)
        for answer in answers:
            assert struct.unpack_from("=IB", bus.recv(64)) == (CobId.SYNC, 0)
            if answer is not None:
                bus.send(struct.pack("=IB3x8s", CobId.MEASURED + 1, 8, answer))

    thread = threading.Thread(target=serve)
    thread.start()
    return thread


def test_a_socket_carries_each_period_and_a_missing_answer_keeps_the_last_measurement():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    drives = hooked(Link.SOCKETCAN)
    drives.socket = ours.fileno()
    drives.sign[0], drives.of_count[0], drives.each[0].amperes = 1.0, 0.001, 0.003
    answers = [None if k == 2 else struct.pack("<Hih", 0x27, 1000 + k, 25) for k in range(4)]
    with ours, theirs:
        thread, measured = answering(theirs, answers), []
        for answer in answers:
            drives.answer_ns = 50_000_000 if answer is None else 2_000_000_000
            call("can_read", ctypes.byref(drives))
            measured.append((drives.q[0], drives.state_sequence))
        thread.join(5.0)
    assert measured == [(0.001 * 1000, 1), (0.001 * 1001, 2), (0.001 * 1001, 2), (0.001 * 1003, 4)]
    assert drives.incomplete == 1
    assert drives.joint_current[0] == 0.003 * 25


def test_a_socket_without_a_receiver_and_a_closed_one_are_counted_and_delay_nothing():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    drives = hooked(Link.SOCKETCAN)
    drives.socket, drives.answer_ns = ours.fileno(), 1_000_000
    with ours:
        theirs.close()
        call("can_read", ctypes.byref(drives))
        assert drives.counts[NOT_SENT] == 1
    drives.socket = os.dup(0)
    os.close(drives.socket)
    call("can_read", ctypes.byref(drives))
    assert drives.counts[NOT_SENT] == 2
    assert drives.counts[NOT_HEARD] >= 2


@pytest.mark.parametrize(
    ("interface", "channel", "runs"),
    [
        ("socketcan", "can0", True),
        ("udp_multicast", "239.74.163.2", True),
        ("udp_multicast", "239.74.163.2:4000", True),
        ("udp_multicast", "ff15:7079:7468:6f6e:6465:6d6f:6d63:6173", False),
        ("udp_multicast", "bus.local", False),
        ("slcan", "/dev/ttyACM0", False),
    ],
)
def test_only_an_adapter_whose_bytes_c_knows_runs_in_c(interface: str, channel: str, runs: bool):
    drives = load_drives(EXAMPLE, load_rig("recupera_like"))
    rig = CanopenRig(drives)
    rig._settings = rig._settings.model_copy(update={"interface": interface, "channel": channel})
    assert runs_in_c(rig) is runs
