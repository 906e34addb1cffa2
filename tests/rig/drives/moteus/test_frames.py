"""Our frames equal those of the maker's library, and the simulated drive decodes them in the same way."""

import math
import struct
from typing import Any

import moteus
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from exograv.rig.drives.moteus.frames import QUESTION, CommandLines, answer
from exograv.rig.drives.moteus.simulated import registers as at
from exograv.rig.drives.moteus.simulated.node import POSITION, SimulatedMoteus
from exograv.rig.drives.settings import Drives

OURS, NUMBER, MOST_Nm, WATCHDOG_s = 126, 3, 40.0, 0.02
FINITE = st.floats(-100.0, 100.0, width=32)
R = moteus.Register


def data_of(line: bytes) -> bytes:
    return bytes.fromhex(line.split()[3].decode())


def orders() -> CommandLines:
    return CommandLines(NUMBER, OURS, MOST_Nm, WATCHDOG_s)


@given(torque=FINITE, damping=st.floats(0.0, 10.0, width=32))
def test_an_order_is_a_torque_and_a_damping_and_nothing_that_pulls_towards_a_position(torque: float, damping: float):
    said: dict[int, Any] = moteus.parse_registers(data_of(orders().torque(torque, damping))).command
    assert said[R.MODE] == moteus.Mode.POSITION
    assert (said[R.COMMAND_FEEDFORWARD_TORQUE], said[R.COMMAND_KD_SCALE]) == (torque, damping)
    assert math.isnan(said[R.COMMAND_POSITION])
    assert (said[R.COMMAND_VELOCITY], said[R.COMMAND_KP_SCALE], said[R.COMMAND_ILIMIT_SCALE]) == (0.0, 0.0, 0.0)
    assert said[R.COMMAND_VELOCITY_LIMIT] < 0.0
    assert said[R.COMMAND_ACCEL_LIMIT] < 0.0
    assert said[R.COMMAND_POSITION_MAX_TORQUE] == MOST_Nm
    assert said[R.COMMAND_TIMEOUT] == pytest.approx(WATCHDOG_s)


def test_a_line_is_the_makers_own_for_the_same_frame():
    assert orders().stop == b"can send 7e03 010000 BF\n"
    assert orders().brake == b"can send 7e03 01000F BF\n"
    words = orders().torque(1.0, 0.5).split()
    assert (words[:3], words[4]) == ([b"can", b"send", b"7e03"], b"BF")
    assert len(words[3]) == 2 * 48


@pytest.mark.parametrize("endless", [0.0, math.nan, math.inf, -1.0])
def test_no_order_can_be_made_that_holds_for_ever_or_by_a_default(endless: float):
    with pytest.raises(ValueError, match="moteus"):
        CommandLines(NUMBER, OURS, MOST_Nm, endless)


KINDS = (moteus.INT8, moteus.INT16, moteus.INT32, moteus.F32)


@given(torque=st.floats(-20.0, 20.0), kinds=st.lists(st.sampled_from(KINDS), min_size=4, max_size=4))
def test_the_simulated_drive_reads_writes_as_the_library_does(torque: float, kinds: list[int]):
    told = moteus.PositionResolution()
    told.position, told.feedforward_torque, told.kp_scale, told.watchdog_timeout = kinds
    made = moteus.Controller(id=1, position_resolution=told).make_position(
        position=math.nan, velocity=0.25, feedforward_torque=torque, kp_scale=0.5, watchdog_timeout=0.02
    )
    read = {
        register: value
        for one in at.subframes(made.data)
        for register, value in enumerate(one.values, one.first)
    }  # fmt: skip
    theirs = moteus.parse_registers(made.data).command
    assert set(read) == set(theirs)
    np.testing.assert_allclose([read[r] for r in theirs], [float(v) for v in theirs.values()], rtol=1e-6)


def replied(turns: float, current: float, mode: int = POSITION, code: int = 0, supply: float = 24.0) -> bytes:
    """Answer of the simulated drive to our question."""
    has = {at.MODE: mode, at.POSITION: turns, at.CURRENT: current, at.VOLTAGE: supply, at.TEMPERATURE: 31.0}
    has[at.FAULT] = code
    asked = list(at.subframes(QUESTION))
    return b"".join(at.reply(one.type, one.first, [has[one.first + j] for j in range(one.n)]) for one in asked)


@given(turns=FINITE, current=FINITE, supply=st.integers(0, 60))
def test_an_answer_says_the_same_to_us_to_the_library_and_to_the_simulated_drive(
    turns: float, current: float, supply: int
):
    data = replied(turns, current, supply=0.5 * supply)
    said, theirs = answer(data), moteus.parse_registers(data).response
    assert said is not None
    assert said == (POSITION, turns, current, 0.5 * supply, 31.0, 0)
    assert list(said) == [theirs[r] for r in (R.MODE, R.POSITION, R.Q_CURRENT, R.VOLTAGE, R.TEMPERATURE, R.FAULT)]


def test_an_answer_whose_registers_are_put_otherwise_is_understood_too():
    whole = at.reply(3, at.MODE, [10.0, 0.25, 0.0, 0.0, 1.5]) + at.reply(1, at.VOLTAGE, [24.0, 31.0, 0.0])
    assert answer(whole) == (10, 0.25, 1.5, 24.0, 31.0, 0)


@pytest.mark.parametrize("data", [b"", b"\x31\x01\x01", QUESTION, replied(math.nan, 1.0), replied(1.0, math.nan)])
def test_what_has_no_position_or_no_current_is_no_answer(data: bytes):
    assert answer(data) is None


@example(data=bytes.fromhex("42008002"))  # a poll for 256 bytes: the maker's parser raises ValueError
@given(data=st.binary(max_size=64))
def test_no_bytes_can_disturb_us_or_the_simulated_drive(data: bytes):
    answer(data)
    list(at.subframes(data))


def driven(drives: Drives, plant: Any, kp: float, data: bytes) -> float:
    """Torque that a simulated drive commands to its motor after this frame, as a current [A]."""
    node = SimulatedMoteus(plant, drives, 0)
    node.config["servo.pid_position.kp"] = kp
    node.step(plant.twin.period_s, plant.now)
    node.mode = POSITION
    node.receive(data, plant.now)
    plant.step()
    return plant.outputs[0].current


def test_half_an_order_moves_no_drive_whose_kp_is_0_and_that_is_why_it_has_to_be(drives: Drives, plant: Any):
    whole = data_of(orders().torque(0.0, 0.0))
    halves = [whole[:k] for k in range(len(whole))]
    assert max(abs(driven(drives, plant, 0.0, half)) for half in halves) == 0.0
    assert max(abs(driven(drives, plant, 100.0, half)) for half in halves) > 1.0


def test_floats_travel_with_the_lowest_byte_first():
    assert struct.pack("<f", 2.5) in data_of(orders().torque(2.5, 0.0))
