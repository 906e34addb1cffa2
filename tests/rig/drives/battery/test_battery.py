"""Every driver gives no torque without a command, whatever is disconnected or killed.

The simulated drives run in another process. All results come from the device's own report, in its own time. Each poll
is one step of the device, so that a busy computer changes nothing.
"""

import re
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from exograv.errors import ConfigError, RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.opening import DrivenRig
from exograv.rig.drives.settings import Drives
from exograv.rig.interface import Powered, Rig

from .driving import CURRENT, LATE_MS, are_on, brakes, currents, drive, told, watchdogs

LOCK_STEP = True


def test_it_is_a_rig_that_is_powered_and_nothing_is_on_before_somebody_enables(rig: Any, bench: Any):
    assert isinstance(rig, Rig)
    assert isinstance(rig, Powered)
    assert isinstance(rig, DrivenRig)  # otherwise a self-test would not switch it on
    drive(rig, 0.05, CURRENT)
    assert are_on(bench) == [False] * 4
    assert not any(one.is_enabled for one in rig.status())


def test_an_enabled_machine_gives_what_it_is_told_and_a_disabled_one_brakes(rig: Any, bench: Any, drives: Drives):
    rig.enable()
    state = drive(rig, 0.2, CURRENT)
    assert all(one.is_enabled and not one.fault for one in rig.status())
    assert state.faulty == ()
    # CiA 402 counts in thousandths of the rated current, in commands and in measurements.
    np.testing.assert_allclose(state.current, CURRENT, atol=1e-3 * max(one.current_rated_A for one in drives.each))
    rig.disable()
    drive(rig, 0.05, CURRENT)
    assert brakes(bench, drives)


def test_a_current_beyond_the_limit_is_cut_and_counted(rig: Any, bench: Any, drives: Drives):
    rig.enable()
    state = rig.read()
    rig.write(told(rig, state, -1e6))
    assert rig.counts["limited"] == 1
    assert max(map(abs, currents(bench))) <= max(one.current_max_A for one in drives.each)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_no_number_is_refused_before_it_is_sent(rig: Any, wrong: float):
    state = rig.read()
    with pytest.raises(RigError, match="elbow_flexion"):
        rig.write(told(rig, state, [0.0, 0.0, 0.0, wrong]))
    with pytest.raises(RigError, match="not finite"):
        rig.write(told(rig, state, 0.0, wrong))


def test_a_command_that_is_void_already_is_not_sent(rig: Any):
    rig.enable()
    state = rig.read()
    rig.write(told(rig, state)._replace(valid_until=rig.t - 1e-6))
    assert rig.counts["expired"] == 1


def test_without_commands_the_drives_brake_by_themselves_and_torque_does_not_come_back(
    rig: Any, bench: Any, drives: Drives
):
    rig.enable()
    drive(rig, 0.1, CURRENT)
    for _ in range(round(0.03 / rig.period_s)):
        rig.read()
    assert max(watchdogs(bench, drives).values()) <= drives.settings.watchdog_ms + LATE_MS
    assert brakes(bench, drives)
    state = drive(rig, 0.1, CURRENT)
    assert brakes(bench, drives)
    assert state.faulty == (0, 1, 2, 3)
    assert all(one.fault is DriveFault.WATCHDOG for one in rig.status())
    rig.enable()
    state = drive(rig, 0.1, CURRENT)
    assert state.faulty == ()
    assert min(map(abs, currents(bench))) > 0.0


def test_a_drive_that_is_unplugged_is_faulty_and_stays_off_until_somebody_enables(rig: Any, bench: Any):
    rig.enable()
    bench.do("unplug shoulder_rotation")
    state = drive(rig, 0.05, CURRENT)
    assert state.faulty == (2,)
    assert np.isfinite(state.q).all()
    assert DriveFault.LOST in rig.status()[2].fault
    drive(rig, 0.1, CURRENT)
    bench.do("plug shoulder_rotation")
    state = drive(rig, 0.2, CURRENT)
    assert state.faulty == (2,)
    rig.disable()
    rig.enable()
    drive(rig, 0.05, CURRENT)
    assert rig.read().faulty == ()
    assert are_on(bench) == [True] * 4


def test_a_drive_that_repeats_its_last_sample_is_faulty_where_samples_are_counted(rig: Any, bench: Any, driver: Any):
    rig.enable()
    drive(rig, 0.05, CURRENT)
    bench.do("freeze shoulder_rotation")
    assert drive(rig, 0.015, CURRENT).faulty == ()
    state = drive(rig, 0.02, CURRENT)
    assert state.faulty == ((2,) if driver.counts_samples else ())
    assert (DriveFault.LOST in rig.status()[2].fault) == driver.counts_samples
    bench.do("thaw shoulder_rotation")
    rig.enable()
    assert drive(rig, 0.05, CURRENT).faulty == ()


def test_where_nobody_is_expected_to_answer_time_passes_all_are_lost_and_the_drives_brake(
    rig: Any, bench: Any, drives: Drives
):
    rig.enable()
    before = drive(rig, 0.05, CURRENT)
    bench.do("cut")
    rig.expect_silence()
    state, t = drive(rig, 0.05), rig.t
    assert t == pytest.approx(before.t + 0.05 + rig.period_s)
    assert state.faulty == (0, 1, 2, 3)
    assert (state.sequence, state.q.tolist()) == (before.sequence, before.q.tolist())
    assert all(DriveFault.LOST in one.fault for one in rig.status())
    assert any(brakes(bench, drives) for _ in range(200))  # the device may lag behind the driver
    bench.do("mend")


def test_the_fault_of_one_drive_is_told_and_forgotten_by_enabling_alone(rig: Any, bench: Any):
    rig.enable()
    bench.do("fail elbow_flexion")
    state = drive(rig, 0.05, CURRENT)
    assert state.faulty == (3,)
    assert rig.status()[3].fault is DriveFault.INTERNAL
    assert drive(rig, 0.1, CURRENT).faulty == (3,)
    assert are_on(bench) == [True, True, True, False]
    rig.enable()
    assert drive(rig, 0.05).faulty == ()


def test_while_the_hardware_stop_is_pressed_nothing_can_be_switched_on(rig: Any, bench: Any):
    rig.enable()
    bench.do("press")
    assert drive(rig, 0.05, CURRENT).faulty == (0, 1, 2, 3)
    with pytest.raises(RigError, match="stop line"):
        rig.enable()
    assert are_on(bench) == [False] * 4
    bench.do("release")
    assert are_on(bench) == [False] * 4
    rig.enable()
    assert are_on(bench) == [True] * 4


def test_a_drive_that_is_too_hot_says_so_and_cannot_be_switched_on(rig: Any, bench: Any):
    rig.enable()
    bench.do("heat shoulder_flexion 120")
    assert drive(rig, 0.05).faulty == (0,)
    with pytest.raises(RigError, match="shoulder_flexion is too hot"):
        rig.enable()
    bench.do("heat shoulder_flexion 30")
    rig.enable()
    assert are_on(bench) == [True] * 4


def test_a_drive_with_another_nameplate_than_the_file_is_refused_and_left_alone(
    driver: Any, bench: Any, drives: Drives, make_rig: Any
):
    for key, value in driver.plates.items():
        other = replace(drives, each=(*drives.each[:3], drives.each[3].model_copy(update={key: value})))
        with pytest.raises(ConfigError, match=f"elbow_flexion .*{key} .*{value:g}"), make_rig(other):
            pass
        assert are_on(bench) == [False] * 4


def test_no_drive_watches_for_another_time_than_the_file_states(driver: Any, bench: Any, drives: Drives, make_rig: Any):
    other = replace(drives, settings=drives.settings.model_copy(update={"watchdog_ms": 30.0}))
    if not driver.sets_watchdogs:
        with pytest.raises(ConfigError, match="watchdog"), make_rig(other):
            pass
        return
    with make_rig(other) as rig:
        rig.enable()
        drive(rig, 0.1, CURRENT)
        for _ in range(round(0.04 / rig.period_s)):
            rig.read()
        times = watchdogs(bench, other).values()
    assert 30.0 - 2e3 * rig.period_s <= min(times) <= max(times) <= 30.0 + LATE_MS


def test_a_second_host_is_refused_and_the_first_keeps_its_machine(rig: Any, bench: Any, drives: Drives, make_rig: Any):
    rig.enable()
    refused: list[Exception] = []

    def intrude():
        try:
            with make_rig(drives):
                pass
        except RigError as error:
            refused.append(error)

    intruder = threading.Thread(target=intrude)
    intruder.start()
    while intruder.is_alive():
        drive(rig, 0.05, CURRENT)
    assert re.search("[Aa]nother host", str(refused[0]))
    assert are_on(bench) == [True] * 4
    assert rig.read().faulty == ()
