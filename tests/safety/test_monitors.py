"""Redundant signals that disagree are found in time, and noise, gear compliance and delays cause no finding."""

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard, SafeState
from exograv.safety.ingress import Ingress
from exograv.safety.limits import Limits
from exograv.safety.monitors import IN_A_ROW_MS, LATELY_MS, REFUSED_S, STILL_MS
from exograv.safety.native.core import AGREE_RAD, REFUSED_NM, SLOW_RAD_S, STILL_WAY_RAD, TORQUE_OFF_NM
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

from .monitors_alone import Monitors

DT = 0.001
GAIN = [2.0, 0.5]
NO_TORQUE = np.full(2, np.nan)


def state(tick: int, q: list[float], q_motor: list[float] | None, current: list[float], faulty: tuple[int, ...] = ()):
    motor = None if q_motor is None else np.array(q_motor)
    source = TorqueSource.CURRENT
    return JointState(tick * DT, tick, np.array(q), np.array(current), NO_TORQUE, source, motor, faulty)


def found(monitors: Monitors, states, told=(0.0, 0.0)) -> list[tuple[int, StopReason, int]]:
    results = []
    for tick, one in enumerate(states):
        results += [(tick, reason, joint) for reason, joint in monitors.look(one)]
        monitors.told(list(told))
    return results


def test_encoders_that_differ_by_gear_noise_and_a_constant_cause_no_finding():
    generator, states = np.random.default_rng(0), []
    for tick in range(2000):
        q = 0.5 * np.sin(3.0 * tick * DT)
        noise = generator.normal(0.0, 2e-4, 2)
        states.append(
            state(tick, [q, -q], [q + 0.3 + noise[0] + 0.002 * np.sin(tick), -q - 0.1 + noise[1]], [0.0, 0.0])
        )
    assert found(Monitors(2, DT, GAIN), states) == []


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_encoder_that_slips_beyond_two_degrees_is_found_after_ten_ticks(side: float):
    slipped = [state(t, [side * AGREE_RAD * 1.1 * (t >= 50), 0.0], [0.0, 0.0], [0.0, 0.0]) for t in range(70)]
    assert found(Monitors(2, DT, GAIN), slipped)[0] == (50 + IN_A_ROW_MS - 1, StopReason.ENCODERS_PART, 0)
    for share in (0.9, 1.0):
        within = [state(t, [side * AGREE_RAD * share * (t >= 50), 0.0], [0.0, 0.0], [0.0, 0.0]) for t in range(200)]
        assert found(Monitors(2, DT, GAIN), within) == []


def test_a_period_too_short_for_the_commands_of_thirty_milliseconds_is_refused():
    for period_s in (2.0e-4, 2.2e-4, 2.343e-4):
        with pytest.raises(ConfigError, match=r"the guard needs at least 0\.00025 s"):
            Monitors(2, period_s)
    Monitors(2, 2.345e-4)  # these need all places of the ring


def test_two_encoders_whose_positions_have_opposite_signs_do_not_part_by_that():
    ways = [0.0] * 8 + [1.1 * AGREE_RAD] * 20
    slipped = [state(t, [0.5 + way, 0.0], [-0.5, 0.0], [0.0, 0.0]) for t, way in enumerate(ways)]
    assert found(Monitors(2, DT, GAIN), slipped)[0] == (8 + IN_A_ROW_MS - 1, StopReason.ENCODERS_PART, 0)


def test_a_measurement_without_motor_positions_neither_parts_encoders_nor_hides_that_they_part():
    monitors = Monitors(2, DT, GAIN)
    moving = [state(t, [0.001 * t, 0.0], [0.001 * t, 0.0] if t < 30 else None, [0.0, 0.0]) for t in range(200)]
    assert found(monitors, moving) == []
    slipped = [
        state(t, [1.1 * AGREE_RAD * (t > 0), 0.0], [0.0, 0.0] if t != 6 else None, [0.0, 0.0]) for t in range(30)
    ]
    assert found(Monitors(2, DT, GAIN), slipped)[0] == (IN_A_ROW_MS + 1, StopReason.ENCODERS_PART, 0)


@pytest.mark.parametrize("speed", [0.3, 1.0, -2.0])
def test_an_encoder_that_counts_the_other_way_is_found_within_20_ms(speed: float):
    flip = 100
    states = []
    for t in range(200):
        way = speed * t * DT
        q = way if t < flip else 2 * speed * flip * DT - way
        states.append(state(t, [q, 0.0], [way, 0.0], [0.0, 0.0]))
    tick, reason, joint = found(Monitors(2, DT, GAIN), states)[0]
    assert (reason, joint) == (StopReason.ENCODERS_PART, 0)
    assert tick - flip <= 20


@pytest.mark.parametrize("way", [-0.2, 0.2])
def test_an_encoder_still_while_its_motor_turns_is_found_and_a_coarse_one_of_a_slow_joint_is_not(
    way: float,
):
    dead = [state(t, [way * min(t, 50) * DT, 0.0], [way * t * DT, 0.0], [0.0, 0.0]) for t in range(100)]
    tick, reason, joint = found(Monitors(2, DT, GAIN), dead)[0]
    assert (reason, joint) == (StopReason.ENCODERS_PART, 0)
    assert 20 <= tick - 50 <= 22
    count = 2.0 * np.pi / 2**14
    slow = [
        state(t, [np.floor(0.01 * t * DT / count) * count, 0.0], [0.01 * t * DT, 0.0], [0.0, 0.0]) for t in range(900)
    ]
    assert found(Monitors(2, DT, GAIN), slow) == []


@pytest.mark.parametrize(("way", "tick"), [(STILL_WAY_RAD, None), (1.001 * STILL_WAY_RAD, STILL_MS)])
def test_an_encoder_is_dead_after_twenty_ticks_of_the_same_and_more_than_eight_counts_of_its_motor(
    way: float, tick: int | None
):
    stuck = [state(t, [0.0, 0.0], [way * (t > 0), 0.0], [0.0, 0.0]) for t in range(60)]
    results = found(Monitors(2, DT, GAIN), stuck)
    assert results[:1] == ([] if tick is None else [(tick, StopReason.ENCODERS_PART, 0)])


def test_a_motor_that_does_not_give_its_torque_is_found_and_one_that_is_late_is_not():
    weak = [state(t, [0.0, 0.0], None, [0.0, 0.0]) for t in range(40)]
    tick, reason, joint = found(Monitors(2, DT, GAIN), weak, told=(0.0, TORQUE_OFF_NM + 0.1))[0]
    assert (reason, joint) == (StopReason.TORQUE_WRONG, 1)
    assert tick == LATELY_MS + IN_A_ROW_MS - 1
    monitors, line = Monitors(2, DT, GAIN), [0.0] * 8
    for t in range(400):
        asked = 10.0 * np.sin(12.0 * t * DT)  # 120 N·m/s
        line.append(asked / GAIN[0])
        assert list(monitors.look(state(t, [0.0, 0.0], None, [line.pop(0), 0.0]))) == []
        monitors.told([asked, 0.0])


def test_a_drive_fault_is_found_at_once_and_an_isolated_drive_is_ignored():
    monitors = Monitors(2, DT, GAIN)
    assert list(monitors.look(state(0, [0.0, 0.0], None, [0.0, 0.0], (1,)))) == [(StopReason.DRIVE_FAULT, 1)]
    assert list(monitors.look(state(1, [0.0, 0.0], None, [0.0, 0.0], (1,)), {1})) == []


def guard() -> Guard:
    limits = Limits(np.array([30.0, 20.0]), np.array([10.0, 4.0]))
    return Guard(Envelope(limits, DT), Ingress([1e-6, 1e-6], DT, limits.v_trip_rad_s), DT, GAIN)


def step(one: Guard, tick: int, **changes) -> SafeState:
    measured = state(tick, changes.get("q", [0.0, 0.0]), None, [0.0, 0.0], changes.get("faulty", ()))
    return one.step(measured, ControlRequest(tick, tick * DT + 0.005, np.zeros(2)), tick * DT).safe_state


def test_the_joint_of_a_faulty_drive_is_isolated_and_the_others_come_down():
    one = guard()
    assert step(one, 0) is SafeState.NONE
    assert step(one, 1, faulty=(1,)) is SafeState.ISOLATION
    assert one.envelope.isolated == {1}
    assert one.envelope.powerless == set()
    assert one.envelope.stop is StopReason.DRIVE_FAULT


def test_a_pressed_stop_lets_the_arm_down_with_its_own_reason():
    one = guard()
    step(one, 0)
    one.press_stop()
    assert step(one, 1) is SafeState.DESCENT
    assert one.envelope.stop is StopReason.STOP_PRESSED


@pytest.mark.parametrize(("speed", "is_found"), [(0.14, False), (-0.14, False), (0.16, True), (-0.16, True)])
@pytest.mark.parametrize("slow_one", [0, 1])
def test_encoders_that_part_slowly_may_be_noise_and_faster_ones_are_not(speed: float, is_found: bool, slow_one: int):
    # In 20 ticks they part by less than two degrees.
    ways = [[speed * t * DT, -3.0 * speed * t * DT][:: 1 - 2 * slow_one] for t in range(25)]
    states = [state(t, [0.0, way], [0.0, other], [0.0, 0.0]) for t, (way, other) in enumerate(ways)]
    assert [(reason, j) for _, reason, j in found(Monitors(2, DT, GAIN), states)[:1]] == (
        [(StopReason.ENCODERS_PART, 1)] if is_found else []
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("off", "is_found"), [(0.99, False), (1.0, False), (1.01, True)])
def test_a_torque_sensor_is_used_in_place_of_currents(side: float, off: float, is_found: bool):
    tau, none = np.array([5.0, 5.0 + side * off * TORQUE_OFF_NM]), np.full(2, np.nan)
    sensor = TorqueSource.JOINT_SENSOR
    states = [JointState(t * DT, t, np.zeros(2), none, tau, sensor) for t in range(LATELY_MS + IN_A_ROW_MS)]
    reasons = [(t, reason, j) for t, reason, j in found(Monitors(2, DT), states, told=(5.0, 5.0))]
    assert reasons == ([(LATELY_MS + IN_A_ROW_MS - 1, StopReason.TORQUE_WRONG, 1)] if is_found else [])


def test_a_torque_wrong_for_less_than_ten_ticks_or_at_an_ignored_joint_is_not_found():
    monitors = Monitors(2, DT, GAIN)
    for t in range(100):
        wrong = 0.0 if t % 50 >= IN_A_ROW_MS - 1 else 2.0 * TORQUE_OFF_NM / GAIN[0]
        assert list(monitors.look(state(t, [0.0, 0.0], None, [wrong, 0.0]))) == []
        monitors.told([0.0, 0.0])
    for t in range(100, 130):
        assert list(monitors.look(state(t, [0.0, 0.0], [0.0, 1.0 * (t > 110)], [9.0, 0.0]), {0, 1})) == []
        monitors.told([0.0, 0.0])


def test_a_wrong_torque_leaves_damping_only_and_none_through_that_motor():
    one, states = guard(), []
    for tick in range(LATELY_MS + IN_A_ROW_MS + 1):
        measured = state(tick, [0.0, 0.0], None, [0.0, 8.0])
        states.append(one.step(measured, ControlRequest(tick, tick * DT + 0.005, np.zeros(2)), tick * DT).safe_state)
    assert states[-1] is SafeState.ISOLATION
    assert one.envelope.without_model
    assert one.envelope.powerless == {1}
    np.testing.assert_array_equal(one.envelope.drive_damping, [0.0, 2.0 * 4.0])
    assert one.envelope.stop is StopReason.TORQUE_WRONG


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("bias", "is_found"), [(1.9, False), (2.2, True)])
def test_a_torque_that_is_off_on_average_is_found_within_a_quarter_of_a_second(
    side: float, bias: float, is_found: bool
):
    rng = np.random.default_rng(0)
    noise = rng.normal(0.0, 0.3, 400) + side * bias
    states = [state(t, [0.0, 0.0], None, [0.0, one / GAIN[1]]) for t, one in enumerate(noise)]
    results = found(Monitors(2, DT, GAIN), states)
    assert bool(results) == is_found
    assert all((reason, j) == (StopReason.TORQUE_WRONG, 1) for _, reason, j in results)
    assert not is_found or results[0][0] <= 300


def test_the_average_begins_at_zero_and_has_a_time_constant_of_a_tenth_of_a_second():
    off, share = 2.9, DT / (0.1 + DT)
    states = [state(t, [0.0, 0.0], None, [0.0, off / GAIN[1]]) for t in range(200)]
    tick = found(Monitors(2, DT, GAIN), states)[0][0]
    averaged = int(np.ceil(np.log(1.0 - 2.0 / off) / np.log(1.0 - share)))
    assert tick == LATELY_MS + averaged - 1


@pytest.mark.parametrize("step", [-5.0, 5.0])
def test_a_motor_that_answers_a_step_within_twelve_milliseconds_is_not_wrong(step: float):
    monitors, late = Monitors(2, DT, GAIN), LATELY_MS - 1
    for t in range(200):
        measured = step if t >= 100 + late else 0.0
        assert list(monitors.look(state(t, [0.0, 0.0], None, [0.0, measured / GAIN[1]]))) == []
        monitors.told([0.0, step if t >= 100 else 0.0])


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_slow_motor_that_lags_behind_a_long_ramp_is_not_taken_for_biased(side: float):
    monitors, tau, told = Monitors(2, DT, GAIN), 0.0, 0.0
    for t in range(400):
        assert list(monitors.look(state(t, [0.0, 0.0], None, [0.0, tau / GAIN[1]]))) == []
        told = side * min(max(t - 50, 0) * 0.15, 25.0)  # 150 N·m/s
        monitors.told([0.0, told])
        tau += (1.0 - np.exp(-DT / 0.02)) * (told - tau)  # 8 Hz


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_joint_is_watched_again_after_non_finite_currents(bad: float):
    monitors = Monitors(2, DT, GAIN)
    broken = [state(t, [0.0, 0.0], None, [bad, 0.0]) for t in range(50)]
    for one in broken:
        assert monitors.look(one, {0}) == []
        monitors.told([0.0, 0.0])
    biased = [state(t, [0.0, 0.0], None, [1.4, 0.0]) for t in range(300)]
    assert found(monitors, biased)


def test_a_motor_that_misses_a_step_is_found_as_soon_as_one_that_never_gave_anything():
    monitors, steps_at = Monitors(2, DT, GAIN), 50
    for t in range(steps_at + LATELY_MS + IN_A_ROW_MS - 1):
        assert monitors.look(state(t, [0.0, 0.0], None, [0.0, 0.0])) == []
        monitors.told([10.0 if t >= steps_at else 0.0, 0.0])
    last = state(steps_at + LATELY_MS + IN_A_ROW_MS - 1, [0.0, 0.0], None, [0.0, 0.0])
    assert monitors.look(last) == [(StopReason.TORQUE_WRONG, 0)]


def test_a_torque_that_is_off_to_both_sides_by_turns_is_not_off_on_average():
    to_and_fro = [state(t, [0.0, 0.0], None, [0.0, (-1) ** t * 2.5 / GAIN[1]]) for t in range(600)]
    assert found(Monitors(2, DT, GAIN), to_and_fro) == []


def refusals(asked: float, v: float, ticks: int, before: int = 0) -> bool:
    """Result for a joint in the last of some ticks, after others in which it was asked for no torque."""
    monitors = Monitors(2, DT, GAIN)
    for _ in range(before):
        monitors.is_refused([0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    return [monitors.is_refused([0.0, asked], [0.0, 0.0], [0.0, v]) for _ in range(ticks)][-1]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_refused_torque_is_found_just_beyond_all_its_limits_and_not_at_one_of_them(sign: float):
    enough = round(REFUSED_S / DT)
    assert refusals(sign * 1.001 * REFUSED_NM, sign * 0.999 * SLOW_RAD_S, enough + 1)
    assert refusals(sign * 1.001 * REFUSED_NM, 0.0, enough + 1, before=1)
    assert not refusals(sign * 1.001 * REFUSED_NM, 0.0, enough, before=1)
    assert not refusals(sign * REFUSED_NM, 0.0, 2 * enough)
    assert not refusals(sign * 1.001 * REFUSED_NM, sign * SLOW_RAD_S, 2 * enough)
