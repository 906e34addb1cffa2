"""A simulated drive protects its motor and its joint by itself."""

import numpy as np
import pytest

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drive
from exograv.rig.drives.simulated.firmware import DERATE_FROM_C, MAX_C, SimulatedDrive

DT = 0.001


def drive() -> SimulatedDrive:
    """Drive with a watchdog of 20 ms, 3 A rated and 9 A at most."""
    settings = Drive(joint="elbow", node=1, current_rated_A=3.0, current_max_A=9.0, brake_Nms_per_rad=4.0)
    return SimulatedDrive(settings, 0.02)


def held(one: SimulatedDrive, current: float, seconds: float, now: float = 0.0) -> list[float]:
    """Currents of a drive that gets the same command in every millisecond."""
    given = []
    for k in range(round(seconds / DT)):
        one.tell(current, 0.0, now + k * DT)
        given.append(one.step(DT, now + k * DT).current)
    return given


def test_a_drive_that_is_not_enabled_brakes_whatever_it_is_told():
    one = drive()
    one.tell(2.0, 0.0, 0.0)
    output = one.step(DT, 0.0)
    assert (output.current, output.damping) == (0.0, 4.0)


def test_an_enabled_drive_begins_with_no_torque_even_if_it_was_told_some_before():
    one = drive()
    one.tell(2.0, 0.0, 0.0)
    assert one.enable(0.0)
    assert one.step(DT, 0.0).current == 0.0


def test_a_command_dies_with_its_link_and_does_not_come_back_by_itself():
    one = drive()
    one.enable(0.0)
    one.tell(2.0, 0.0, 0.0)
    times = DT * np.arange(1, 40)
    outputs = [one.step(DT, t) for t in times]
    ended = [t for t, output in zip(times, outputs, strict=True) if output.damping == 4.0]
    assert ended[0] == pytest.approx(0.021)
    assert all(output.current == 0.0 for output in outputs[21:])
    one.tell(2.0, 0.0, 0.05)
    assert one.step(DT, 0.05).current == 0.0
    assert one.fault is DriveFault.WATCHDOG
    assert not one.enable(0.05)
    assert one.acknowledge()
    assert one.enable(0.05)


@pytest.mark.parametrize("told", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_never_becomes_current(told: float):
    one = drive()
    one.enable(0.0)
    one.tell(told, 0.0, 0.0)
    assert one.step(DT, 0.0).current == 0.0
    assert one.fault is DriveFault.INTERNAL


@pytest.mark.parametrize("told", [20.0, -20.0])
def test_no_drive_gives_more_than_its_limit(told: float):
    one = drive()
    one.enable(0.0)
    assert abs(held(one, told, 0.1)[-1]) == 9.0


@pytest.mark.slow
def test_rated_current_may_flow_for_ever_and_three_times_as_much_ends_in_less_torque_then_in_a_fault():
    lasting, short = drive(), drive()
    for one in (lasting, short):
        one.enable(0.0)
    assert min(held(lasting, 3.0, 300.0)) == 3.0
    given = held(short, 9.0, 60.0)
    assert given[0] == 9.0
    assert given[-1] < 6.0
    assert short.temperature_C < MAX_C


def test_a_hot_drive_is_not_acknowledged_before_it_has_cooled_down():
    one = drive()
    one.temperature_C = MAX_C
    one.step(DT, 0.0)
    assert one.fault is DriveFault.TEMPERATURE
    assert not one.acknowledge()
    one.temperature_C = DERATE_FROM_C - 1.0
    assert one.acknowledge()
