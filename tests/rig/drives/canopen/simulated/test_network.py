"""A simulated drive on a CAN bus follows CiA 301 by itself, whatever frames are on its bus."""

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from exograv.model.description import load_rig
from exograv.rig.drives.canopen.bus import Bus
from exograv.rig.drives.canopen.simulated.network import CanopenDevices
from exograv.rig.drives.canopen.simulated.node import ADDITIONAL_POSITION, SimulatedNode
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated import Plant
from exograv.rig.twin import Disturbances, Twin, draw_machine

EXAMPLE = Path(__file__).parents[5] / "examples" / "drives" / "canopen.toml"
SEED = 1000
NODE = 4
ABORTED = 0x80


class Talk:
    """Exchange of one frame and its answers with drives in this process."""

    def __init__(self, devices: CanopenDevices, bus: Bus):
        self.devices, self._bus = devices, bus

    def __call__(self, cob: int, data: bytes) -> list[tuple[int, bytes]]:
        self._bus.send(cob, data)
        rounds = iter([False, True])
        self.devices.run(lambda: next(rounds))
        frames = []
        while (frame := self._bus.receive(0.0)) is not None:
            frames.append((frame.cob, frame.data))
        return frames

    def write(self, index: int, sub: int, value: int, size: int) -> int:
        """Write an object by SDO; return the abort code, 0 on success."""
        command = 0x23 | (4 - size) << 2
        [(cob, answer)] = self(0x600 + NODE, struct.pack("<BHBI", command, index, sub, value))
        assert cob == 0x580 + NODE
        return struct.unpack_from("<I", answer, 4)[0] if answer[0] == ABORTED else 0


@pytest.fixture(scope="module")
def talk() -> Iterator[Talk]:
    description = load_rig("recupera_like")
    drives = load_drives(EXAMPLE, description)
    assert drives.settings.canopen is not None
    wire = drives.settings.canopen.model_copy(update={"interface": "virtual", "channel": "drive_sim"})
    object.__setattr__(drives, "settings", drives.settings.model_copy(update={"canopen": wire}))
    twin = Twin(description, draw_machine(description, Disturbances.at_level(0), SEED), None, SEED)
    bus = Bus(wire)
    with CanopenDevices(Plant(twin, drives), drives, lock_step=True, say=lambda text: None) as devices:
        yield Talk(devices, bus)
    bus.close()


@pytest.fixture(autouse=True)
def fresh(talk: Talk) -> None:
    talk.devices.restart(3)
    talk(0x7F0, b"")  # removes its boot-up message from the bus


def test_a_drive_that_starts_says_so(talk: Talk):
    talk.devices.restart(3)
    assert (0x700 + NODE, b"\0") in talk(0x7F0, b"")


def test_a_mapping_changes_only_while_its_frame_is_invalid_and_empty(talk: Talk):
    assert talk.write(0x1800, 1, 0x184, 4) == 0  # a valid frame cannot be changed
    assert talk.write(0x1A00, 1, 0x60410010, 4) == 0x08000022
    assert talk.write(0x1800, 1, 0x80000184, 4) == 0
    assert talk.write(0x1A00, 1, 0x60410010, 4) == 0
    assert talk.write(0x1A00, 0, 1, 1) == 0
    assert talk.write(0x1A00, 1, 0x60640020, 4) == 0x08000022


@pytest.mark.parametrize("entry", [0x12340010, 0x60410020, 0x60750020 + 8, 0])
def test_only_what_a_drive_has_can_be_mapped_and_only_as_long_as_it_is(talk: Talk, entry: int):
    assert talk.write(0x1A00, 1, entry, 4) == 0x06040041


def test_no_more_is_mapped_than_a_frame_can_carry(talk: Talk):
    for sub in (1, 2, 3):
        assert talk.write(0x1A00, sub, 0x60640020, 4) == 0
    assert talk.write(0x1A00, 0, 4, 1) == 0x06040041
    assert talk.write(0x1A00, 0, 3, 1) == 0x06040041
    assert talk.write(0x1A00, 0, 2, 1) == 0


def test_a_drive_answers_a_sync_as_it_was_mapped_and_only_when_it_is_operational(talk: Talk):
    assert talk.write(0x1A00, 1, 0x60770010, 4) == 0
    assert talk.write(0x1A00, 2, 0x60410010, 4) == 0
    assert talk.write(0x1A00, 0, 2, 1) == 0
    assert talk.write(0x1800, 2, 2, 1) == 0
    assert talk.write(0x1800, 1, 0x184, 4) == 0
    assert talk(0x80, b"") == []
    talk(0x000, bytes([0x01, NODE]))
    assert talk(0x80, b"") == []  # sent with every second SYNC
    [(cob, data)] = talk(0x80, b"")
    assert (cob, len(data)) == (0x184, 4)
    assert struct.unpack_from("<H", data, 2)[0] & 0x4F == 0x40


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frames=st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=8))
def test_no_frame_ends_the_drives(talk: Talk, frames: list[tuple[int, bytes]]):
    for cob, data in frames:
        talk(cob, data)
    talk(0x600 + NODE, struct.pack("<BHB4x", 0x80, 0, 0))  # aborts a transfer that has begun
    answers = talk(0x600 + NODE, struct.pack("<BHB4x", 0x40, 0x1000, 0))
    assert (0x580 + NODE, bytes.fromhex("4300100092010200")) in answers


@pytest.mark.parametrize("has_motor_encoders", [True, False])
def test_only_a_drive_with_an_encoder_on_its_motor_has_an_additional_position(has_motor_encoders: bool):
    description = load_rig("recupera_like")
    drawn = draw_machine(description, Disturbances.at_level(0), SEED)
    machine = replace(drawn, sensors=replace(drawn.sensors, has_motor_encoders=has_motor_encoders))
    plant = Plant(Twin(description, machine, None, SEED), load_drives(EXAMPLE, description))
    node = SimulatedNode(plant, 0, lambda _cob, _data: None, frozenset())
    assert (ADDITIONAL_POSITION in node.local.object_dictionary) == has_motor_encoders
