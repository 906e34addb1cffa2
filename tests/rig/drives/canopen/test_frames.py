"""Frames mean the same at both ends of the bus, and an answer to an older SYNC does not count for a new one."""

import struct

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.canopen import objects as at
from exograv.rig.drives.canopen.emergency import fault_of
from exograv.rig.drives.canopen.node import DAMPING_MOST, TOLD_DAMPED, CanopenNode, OwedAnswers, lost_after
from exograv.rig.drives.canopen.objects import Nmt
from exograv.rig.drives.canopen.states import DISABLE_VOLTAGE, ENABLE
from exograv.rig.drives.settings import CanopenBus, Drive, Drives, DrivesSettings
from exograv.rig.drives.units import Units
from exograv.signals import Command

finite = st.floats(-1e3, 1e3)


def machine(rated: float = 3.0, most: float = 9.0, sign: int = 1, counts: float = 2.0**20, offset: float = 0.0):
    """Drives of a machine with one joint."""
    drive = Drive.model_validate(
        {
            "joint": "elbow",
            "node": 4,
            "sign": sign,
            "counts_per_turn": counts,
            "motor_counts_per_turn": 25.0 * counts,
            "offset_deg": offset,
            "current_rated_A": rated,
            "current_max_A": most,
            "brake_Nms_per_rad": 4.0,
        }
    )
    bus = CanopenBus(interface="virtual", channel="one")
    settings = DrivesSettings(schema_version=1, rig="one", serial="1", canopen=bus, drives=[drive])
    return Drives(settings, (drive,), "")


def wanted(drives: Drives) -> CanopenNode:
    """Drive of that joint, enabled, with a damping object."""
    node = CanopenNode(drives.each[0], has_motor=False, period_s=0.002)
    node.is_wanted, node.has_damping, node.control = True, True, ENABLE
    return node


def per_mille_of(order: bytes) -> int:
    return TOLD_DAMPED.unpack(order)[1]


@given(rated=st.floats(0.1, 50.0), sign=st.sampled_from([1, -1]), share=st.floats(-1.0, 1.0), times=st.floats(1.0, 5.0))
def test_a_current_comes_back_from_the_bus_within_half_a_thousandth_of_the_rated_one(
    rated: float, sign: int, share: float, times: float
):
    drives, current = machine(rated, times * rated, sign), np.array([share * times * rated])
    node, units, none = wanted(drives), Units(drives), np.zeros(1)
    [told] = units.drive_currents(Command(0.0, 0, 1.0, none, current, none)).tolist()
    per_mille = per_mille_of(node.order(told, 0.0))  # raises if it does not fit its frame
    node.on_measured(at.layout(at.MEASURED).pack(0, 0, per_mille))
    assert abs(units.joint_currents(np.array([node.current])) - current)[0] <= 0.5e-3 * rated * (1.0 + 1e-9)


@given(rated=st.floats(0.1, 50.0), sign=st.sampled_from([1, -1]), current=finite)
def test_no_current_beyond_the_drives_greatest_is_sent(rated: float, sign: int, current: float):
    drives, none = machine(rated, 2.0 * rated, sign), np.zeros(1)
    units = Units(drives)
    command = Command(0.0, 0, 1.0, none, np.array([current]), none)
    limited = units.within_limits(command)
    assert abs(limited[0]) <= 2.0 * rated
    assert abs(per_mille_of(wanted(drives).order(float(limited[0]), 0.0))) <= 2000
    assert abs(current) > 2.0 * rated or limited[0] == current


@given(counts=st.integers(-(2**31), 2**31 - 1), sign=st.sampled_from([1, -1]), offset=st.floats(-180.0, 180.0))
def test_counts_are_the_joints_angle_by_sign_and_offset(counts: int, sign: int, offset: float):
    units = Units(machine(sign=sign, offset=offset))
    q = units.positions(np.array([counts]))
    back = sign * (q - np.deg2rad(offset)) * 2.0**20 / (2.0 * np.pi)
    np.testing.assert_allclose(back, counts, rtol=1e-9, atol=1e-6)
    q_motor = units.motor_positions(np.array([counts]))
    assert q_motor is not None
    np.testing.assert_allclose(25.0 * (q_motor - np.deg2rad(offset)), q - np.deg2rad(offset), atol=1e-9)


@given(damping=st.floats(0.0, 1e6))
def test_damping_fits_its_frame_and_is_exact_to_its_last_place(damping: float):
    told = TOLD_DAMPED.unpack(wanted(machine()).order(0.0, damping))[2]
    assert 0 <= told <= 0xFFFF
    assert abs(1e-3 * told - min(damping, DAMPING_MOST)) <= 0.5e-3 + 1e-9


@pytest.mark.parametrize("entries", [(*at.COMMAND, at.DAMPING), at.MEASURED, at.MOTOR, at.SLOW])
def test_every_frame_fits_a_can_frame_and_is_as_long_as_its_mapping_says(entries: tuple[at.Entry, ...]):
    size = at.layout(entries).size
    assert size <= 8
    assert 8 * size == sum(entry.mapping & 0xFF for entry in entries)


def test_a_mapping_is_written_as_the_standard_writes_it():
    assert at.TARGET_TORQUE.mapping == 0x60710010
    assert at.MOTOR_POSITION.mapping == 0x60E40120


@given(word=st.integers(0, 0xFFFF), counts=st.integers(-(2**31), 2**31 - 1), torque=st.integers(-(2**15), 2**15 - 1))
def test_a_node_takes_what_is_in_a_measurement_byte_by_byte(word: int, counts: int, torque: int):
    node = CanopenNode(machine().each[0], has_motor=True, period_s=0.002)
    data = word.to_bytes(2, "little") + counts.to_bytes(4, "little", signed=True)
    node.on_measured(data + torque.to_bytes(2, "little", signed=True))
    assert (node.position, node.current) == (counts, 3.0 / 1000.0 * torque)


@given(data=st.binary(max_size=8), handler=st.sampled_from(["measured", "motor", "slow", "emergency", "heartbeat"]))
def test_no_frame_breaks_a_node_and_only_a_whole_measurement_counts(data: bytes, handler: str):
    node = CanopenNode(machine().each[0], has_motor=False, period_s=0.002)
    node.ask()
    getattr(node, f"on_{handler}")(data)
    assert node.has_answered == (handler == "measured" and len(data) == 8)


def test_an_answer_to_an_older_sync_is_none_to_this_one():
    due = OwedAnswers()
    due.ask()
    due.close()
    due.came()  # arrives too late
    due.ask()
    assert due.missing == 1
    due.close()
    due.came()  # again a period late; it answers two SYNCs
    due.ask()
    assert due.missing == 1
    due.came()
    assert due.missing == 0


def test_an_answer_that_comes_in_the_next_period_does_not_count_for_that():
    due = OwedAnswers()
    due.ask()
    due.close()
    due.ask()  # no answer came in the meantime: lost
    assert due.missing == 1
    due.came()
    due.close()
    due.came()
    due.came()
    due.ask()
    assert due.missing == 1


def test_a_drive_is_lost_after_so_many_syncs_without_a_word_and_not_before():
    assert [lost_after(period_s) for period_s in (0.001, 0.002, 0.004)] == [3, 2, 1]
    node = CanopenNode(machine().each[0], has_motor=False, period_s=0.002)
    node.start()
    for k in (1, 2):
        node.ask()
        node.close()
        assert node.was_lost == (k == 2)
    node.on_measured(bytes(8))
    assert node.was_lost


@pytest.mark.parametrize("period_s", [0.001, 0.002, 0.004])
def test_a_drive_is_awaited_until_it_is_lost_and_from_its_next_answer_on(period_s: float):
    node = CanopenNode(machine().each[0], has_motor=False, period_s=period_s)
    node.start()
    for _ in range(lost_after(period_s)):
        node.ask()
        assert node.is_awaited
        assert not node.was_lost
        node.close()
    assert node.was_lost
    node.ask()
    assert not node.is_awaited
    node.close()
    node.on_measured(bytes(8))
    node.ask()
    assert node.is_awaited


def test_a_drive_that_has_just_started_is_not_awaited():
    node = CanopenNode(machine().each[0], has_motor=False, period_s=0.002)
    node.ask()
    node.on_heartbeat(bytes([Nmt.BOOTED]))
    assert not node.is_awaited


def test_a_current_beyond_the_frame_is_the_greatest_that_fits():
    node = wanted(machine(rated=0.01, most=9.0))
    assert per_mille_of(node.order(9.0, 0.0)) == 2**15 - 1
    assert per_mille_of(node.order(-9.0, 0.0)) == 1 - 2**15


@given(code=st.integers(1, 0xFFFF))
def test_what_is_held_against_a_drive_switches_it_off_until_somebody_forgives(code: int):
    assume(fault_of(code))
    node = CanopenNode(machine().each[0], has_motor=False, period_s=0.002)
    node.control, node.is_wanted = 0x0F, True
    node.on_emergency(struct.pack("<HB5x", code, 1))
    node.on_emergency(bytes(8))  # the drive reports the end of the fault
    assert node.control == DISABLE_VOLTAGE
    assert node.fault
    assert not node.is_wanted
    assert node.status.code == code
    node.begin_enabling()
    assert not node.status.fault


CODES = {
    0x2310: DriveFault.CURRENT,
    0x4210: DriveFault.TEMPERATURE,
    0x7305: DriveFault.ENCODER,
    0x8130: DriveFault.WATCHDOG,
    0x8250: DriveFault.WATCHDOG,
    0x9001: DriveFault.STOP_LINE,
    0x3210: DriveFault.INTERNAL,
    0xFF01: DriveFault.INTERNAL,
    0x8140: DriveFault.NONE,
    0x0000: DriveFault.NONE,
}


@pytest.mark.parametrize("code", CODES)
def test_an_error_code_is_the_fault_of_its_class(code: int):
    assert fault_of(code) is CODES[code]


def test_without_the_packages_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    import importlib.util

    from exograv.rig.drives.canopen.bus import Bus

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"pip install exograv\[can\]"):
        Bus(CanopenBus(interface="virtual", channel="one"))
