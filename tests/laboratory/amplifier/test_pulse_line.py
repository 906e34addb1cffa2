"""Datagrams to the simulated amplifier: its own are read, and others do not end it."""

import contextlib
import socket

import numpy as np
import pytest

pytest.importorskip("pylsl")

from exograv.laboratory.amplifier.amplifier_command import _heard
from exograv.laboratory.amplifier.pulse_line import Effort, Pulse, ToAmplifier, true_time

WITHIN_S = 0.3


def test_messages_among_datagrams_that_are_none_are_read_in_order():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        port = line.getsockname()[1]
        begun = true_time()
        with contextlib.closing(ToAmplifier(port)) as sender, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            sender.torque([1.0, -2.5])
            for wrong in (b"", b"\xff", b"[]", b"{}", b'{"kind": "pulse"}', b'{"kind": "pulse", "t": NaN}',
                          b'{"kind": "effort", "torque_Nm": "much"}'):  # fmt: skip
                other.sendto(wrong, ("127.0.0.1", port))
            sender.pulse()
            effort, pulse = _heard(line, WITHIN_S)
    assert effort == Effort(torque_Nm=(1.0, -2.5))
    assert isinstance(pulse, Pulse)
    assert begun <= pulse.t <= true_time()


def test_an_amplifier_that_is_off_stops_no_sender():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        port = line.getsockname()[1]
    with contextlib.closing(ToAmplifier(port)) as sender:
        for _ in range(100):
            sender.torque(np.zeros(4).tolist())
