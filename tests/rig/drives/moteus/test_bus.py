"""Through an fdcanusb only present answers count, no line is sent in part, and a second master is always detected."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.moteus.cycle import OURS, MoteusCycle, load, own_numbers
from exograv.rig.drives.moteus.fdcanusb import Fdcanusb, head, line
from exograv.rig.drives.moteus.node import LOST_AFTER, MoteusNode
from exograv.rig.drives.moteus.simulated.adapter import SimulatedFdcanusb, checksum
from exograv.rig.drives.settings import Drives

from .test_frames import replied

WAIT_S = 0.05


@pytest.fixture
def adapter(tmp_path: Path) -> Iterator[SimulatedFdcanusb]:
    made = SimulatedFdcanusb(str(tmp_path / "adapter"))
    yield made
    made.close()


@pytest.fixture
def link(adapter: SimulatedFdcanusb) -> Iterator[Fdcanusb]:
    made = Fdcanusb(str(adapter.path))
    yield made
    made.close()


@pytest.fixture
def cycle(link: Fdcanusb, drives: Drives) -> MoteusCycle:
    return MoteusCycle(link, [MoteusNode(drive) for drive in drives.each])


def nodes_of(cycle: MoteusCycle) -> tuple[MoteusNode, ...]:
    return cycle._nodes  # pyright: ignore[reportPrivateUsage]


def test_an_answer_to_an_earlier_question_is_counted_and_not_believed(
    cycle: MoteusCycle, link: Fdcanusb, adapter: SimulatedFdcanusb
):
    assert not cycle.ask(0.0)
    asked = [number for number, _ in adapter.frames(WAIT_S)]
    for number in asked:
        adapter.say((number & 0x7F) << 8 | number >> 8 & 0x7F, replied(0.5, 1.0))
    assert not cycle.ask(0.0)
    assert link.counts["late"] == len(asked) == 4
    assert not any(node.said.current_A for node in nodes_of(cycle))


def test_every_tick_asks_under_a_number_of_its_own_and_none_is_a_drives(cycle: MoteusCycle, adapter: SimulatedFdcanusb):
    askers = []
    for _ in range(OURS):
        cycle.ask(0.0)
        askers.append({number >> 8 & 0x7F for number, _ in adapter.frames(WAIT_S)})
    assert [len(one) for one in askers] == [1] * OURS
    assert len(set.union(*askers)) == OURS
    assert not set(own_numbers([126, 3, 125])) & {126, 3, 125}


def test_a_drive_that_is_silent_for_three_questions_is_lost(cycle: MoteusCycle):
    for _ in range(LOST_AFTER - 1):
        cycle.ask(0.0)
    assert not any(node.fault for node in nodes_of(cycle))
    cycle.ask(0.0)
    assert all(node.fault is DriveFault.LOST for node in nodes_of(cycle))


@pytest.mark.parametrize("frame", [0x8001, 0x007F, 0x0200], ids=["a question", "to all", "an answer to another"])
def test_another_master_is_heard_before_anything_is_said_and_held_against_all(
    frame: int, cycle: MoteusCycle, adapter: SimulatedFdcanusb
):
    adapter.say(frame, b"\x50")
    with pytest.raises(RigError, match=f"Another host .* 0x{frame:04x}"):
        cycle.refuse_others()
    assert all(node.fault is DriveFault.OTHER_MASTER for node in nodes_of(cycle))


def test_a_stranger_who_speaks_to_none_of_our_drives_is_no_other_master(cycle: MoteusCycle, adapter: SimulatedFdcanusb):
    adapter.say(0x0B0C, b"\x50")
    cycle.refuse_others()


def test_a_line_that_was_sent_in_part_is_no_frame_and_the_next_one_is(link: Fdcanusb, adapter: SimulatedFdcanusb):
    whole = line(head(1, 126, wants_answer=False), bytes(range(48)))
    while not link.counts["not sent"]:  # no host reads them
        link.send(whole)
    heard = [data for _ in range(20) for _, data in adapter.frames(0.0)]
    link.send(line(head(2, 126, wants_answer=False), b"\x01"))
    heard += [data for _ in range(20) for _, data in adapter.frames(0.0)]
    assert set(heard) == {bytes(range(48)), b"\x01"}


def test_a_pulled_adapter_is_silence_at_once(tmp_path: Path):
    pulled = SimulatedFdcanusb(str(tmp_path / "pulled"))
    link = Fdcanusb(str(pulled.path))
    pulled.close()
    assert link.receive(WAIT_S) is None
    link.send(b"can send 8001 50 BF\n")
    link.close()
    assert link.counts["not sent"] + link.counts["not heard"] == 2


def test_lines_that_are_none_are_counted(adapter: SimulatedFdcanusb, link: Fdcanusb):
    for text in (b"rcv zz 50", b"rcv", b"ERR unknown command", b"rcv 0101 5050 E B F"):
        os.write(adapter._ours, text + b"\r\n")  # pyright: ignore[reportPrivateUsage]
    frame = link.receive(0.0)
    assert frame is not None
    assert (frame.source, frame.destination, frame.data) == (1, 1, b"PP")
    assert (link.counts["garbled"], link.counts["adapter errors"], link.error) == (2, 1, "ERR unknown command")


def test_one_adapter_has_one_host(link: Fdcanusb, adapter: SimulatedFdcanusb):
    with pytest.raises(RigError, match="another host"):
        Fdcanusb(str(adapter.path))
    assert link.error == ""


@pytest.mark.parametrize(("path", "why"), [("nothing-here", "does not open"), ("a-file", "not a serial port")])
def test_a_path_that_is_no_adapter_is_refused(path: str, why: str, tmp_path: Path):
    (tmp_path / "a-file").write_text("")
    with pytest.raises(RigError, match=why):
        Fdcanusb(str(tmp_path / path))


def test_the_check_of_a_line_is_the_makers():
    assert checksum(b"can send 8001 01000A BF ") == 0x11


def test_four_drives_fit_the_wire_at_500_and_not_at_1000_periods_a_second(drives: Drives):
    assert 0.5 < load(drives) < 1.0
