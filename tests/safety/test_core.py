"""The scalar functions of the guard keep their claims at the values where a rule begins or ends."""

import math

import numpy as np
import pytest

from exograv.safety.envelope import Envelope
from exograv.safety.ingress import Ingress
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.monitors import set_monitors
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.record import GuardRecord
from exograv.safety.stops import StopReason

from .random_machines import draw_history, draw_machines, first_guard, first_step
from .second_envelope import SecondGuard

TICKS = 420


@pytest.mark.parametrize(
    ("value", "nearest"),
    [
        (0.2, 1.0),
        (1.4, 1.0),
        (1.6, 2.0),
        (2.5, 2.0),
        (3.5, 4.0),
        (6.5, 6.0),
        (7.5, 8.0),
        (7.49, 7.0),
        (8.5, 8.0),
        (-5.0, 1.0),
    ],
)
def test_the_nearest_whole_number_is_at_least_1_and_the_even_one_of_two(value: float, nearest: float):
    assert core.whole(value) == nearest


def test_the_nearest_whole_number_of_no_number_is_1_and_of_a_long_time_two_weeks_of_ticks():
    assert core.whole(math.nan) == 1.0
    assert core.whole(math.inf) == core.whole(1e300) == core.TICKS_MOST


def test_a_machine_of_one_joint_carries_another_torque_at_another_gravity_level():
    weight = np.array([[0.0, 0.0, 5.0]])
    table = PlausibleTable((LimbTable((0,), 1, weight, 2.0 * weight),), *[np.zeros(1)] * 3)
    limits = PersonLimits(table, np.ones(1), np.full(1, -3.0), np.full(1, 3.0))
    for levels in ((0.0, 1.0), (1.0, 0.0), (1.8, 1.0), (1.0, 1.8)):
        person = GuardedPerson(limits)
        for level in levels:
            person.gravity_level = level
            person.look([0.5 * math.pi], [0.0])
            assert person._record.of(core.CARRIED)[0] == pytest.approx(5.0 + (1.0 - level) * 10.0)


def quiet_then_frozen() -> tuple[np.ndarray, np.ndarray]:
    """Measured currents (tick, machine, joint), and the tick from which on each joint is frozen (machine, joint)."""
    rng, k = np.random.default_rng(4), np.arange(TICKS)
    turning = np.where(k // 5 % 2, 1.0, -1.0)
    coarse = np.round(rng.normal(0.0, 0.6, (TICKS, 4)))
    fine = rng.normal(0.0, 1.0, (TICKS, 5))
    late_start = np.where(k < 3, 0.0, turning)
    pairs = [
        (turning, -turning),
        (coarse[:, 0], coarse[:, 1]),
        (k // 3 * 0.1, fine[:, 0]),
        (coarse[:, 2], coarse[:, 3]),
        (fine[:, 1], fine[:, 2]),
        (late_start, fine[:, 3]),
    ]
    never = TICKS
    frozen = np.array([(150, 150), (never, 200), (100, 100), (120, 130), (50, 51), (90, never)])
    measured = np.array(pairs).transpose(2, 0, 1).copy()
    for b, joint in np.argwhere(frozen < never):
        measured[frozen[b, joint] :, b, joint] = measured[frozen[b, joint] - 1, b, joint]
    return measured, frozen


def test_two_implementations_agree_how_long_signals_keep_their_bits_and_how_likely_that_is():
    rng = np.random.default_rng(1)
    m = draw_machines(rng, 6, 2)
    m.worn[:], m.count[:] = False, 1e-6
    m.period[:] = [1e-3, 1e-3, 5e-4, 1e-3, 2e-3, 4e-3]
    with np.errstate(all="ignore"):
        history = draw_history(rng, m, TICKS)
    history.reset[:], history.trip[:] = False, 0
    measured, _ = quiet_then_frozen()
    guards, other = [first_guard(m, b)[0] for b in range(6)], SecondGuard(m)
    image = other.ingress.image
    for k, tick in enumerate(history.ticks):
        everybody = np.ones(6, dtype=bool)
        tick.came, tick.spoke, tick.sequence, tick.answers = everybody, everybody, np.full(6, k), np.full(6, k)
        tick.now = tick.t = k * m.period
        tick.valid_until, tick.measured = tick.now + 0.005, measured[k]
        tick.q, tick.tau = np.zeros((6, 2)), np.zeros((6, 2))
        with np.errstate(all="ignore"):
            _, _, states = other.step(tick)
        for b, guard in enumerate(guards):
            out, _ = first_step(guard, history, k, b)
            record = guard.envelope.record
            assert out.safe_state == states[b], (k, b)
            np.testing.assert_array_equal(record.of(core.KEPT_TICKS), image.ticks[b], str((k, b)))
            np.testing.assert_array_equal(record.of(core.KEPT_SEEN), image.seen[b])
            for place, value in (
                (core.KEPT_SHARE, image.share[b]),
                (core.KEPT_CHANCE, np.exp(image.log_chance[b])),
                (core.TURNS, image.turns[b]),
            ):
                np.testing.assert_allclose(record.of(place), value, rtol=1e-9, err_msg=str((k, b)))
    assert {StopReason.MACHINE_SILENT, StopReason.ENCODER_DEAD} <= {guard.envelope.stop for guard in guards}


def test_a_ramp_whose_last_step_is_whole_ends_with_that_step():
    r = GuardRecord(1, 1e-3, library=None).numbers
    r[core.WORN], r[core.LEVEL], r[core.LEVEL_WANTED] = 1.0, 0.0, 1.0
    r[core.LEVEL_STEP], r[core.LEVEL_MOVES] = 0.25, 1.0
    levels = []
    while r[core.LEVEL_MOVES] != 0.0:
        core.approach_level(r)
        levels.append(r[core.LEVEL])
    assert levels == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize(("flag", "reason"), [(core.FAULTY, core.DRIVE_FAULT), (core.PARTED, core.ENCODERS_PART)])
def test_a_joint_whose_drive_or_encoder_fails_is_isolated_alone_and_the_others_keep_the_model(flag: int, reason: int):
    for joint in range(3):
        record = GuardRecord(3, 1e-3, library=None)
        record.numbers[flag + joint] = 1.0
        core.act_on_comparison(record.numbers)
        assert record.numbers[core.STOP] == reason
        assert record.numbers[core.WITHOUT_MODEL] == 0.0
        assert record.joints_at(core.ISOLATED) == {joint}
        assert not record.joints_at(core.POWERLESS)


def test_the_average_torque_error_is_whole_up_to_half_of_its_limit_and_then_beyond_the_last_commands():
    half = 0.5 * core.TORQUE_BIAS_NM
    for share, is_whole in ((0.3, True), (0.7, True), (1.0, True), (1.01, False), (1.2, False)):
        record = GuardRecord(1, 1e-3, library=None)
        set_monitors(record, [1.0], True)
        r, off = record.numbers, share * half
        for k in range(200):  # the command steps up and down within 30 ms, so that it explains the measured torque
            told = 0.0 if k % 20 < 10 else -off
            r[core.TAU] = told
            core.tell(r)
            r[core.CURRENT_IN], r[core.BY_GAIN] = told + off, 1.0
            if k == 150:
                r[core.BIAS] = 0.0
                core.compare_torques(r)
                assert r[core.BIAS] == pytest.approx(r[core.BIAS_SHARE] * off if is_whole else 0.0), share


def test_each_of_the_last_commands_explains_the_torque_that_it_asks_for():
    record = GuardRecord(1, 1e-3, library=None)
    set_monitors(record, [1.0], True)
    r, ticks = record.numbers, 12
    for age in range(ticks + 2):
        for k in range(60):
            r[core.TAU] = 5.0 if 59 - k == age else 0.0
            core.tell(r)
        assert core.off_lately(r, 0, 5.0, ticks) == (0.0 if age < ticks else 5.0), age


def test_before_enough_commands_were_told_no_joint_of_one_encoder_is_judged():
    record = GuardRecord(3, 1e-3, library=None)
    set_monitors(record, [1.0] * 3, True)
    for flag in (core.PARTED, core.WRONG):
        record.put(flag, 1.0)
    core.compare(record.numbers)
    assert not record.joints_at(core.PARTED) | record.joints_at(core.WRONG)


@pytest.mark.parametrize(("share", "is_opposite"), [(1.0, False), (1.01, True)])
def test_encoders_that_move_against_each_other_are_found_beyond_the_least_way(share: float, is_opposite: bool):
    record = GuardRecord(1, 1e-3, library=None)
    set_monitors(record, [1.0], True)
    r = record.numbers
    r[core.LEAST_OPPOSITE] = 0.0078125  # a power of two, so that ways are exact
    way, slots = share * r[core.LEAST_OPPOSITE], int(r[core.SPEED]) + 1
    for k in range(slots):
        there = way if k == slots - 1 else 0.0
        r[core.Q_IN], r[core.Q_MOTOR_IN] = there, -there
        core.compare_encoders(r)
    assert r[core.PARTED_TICKS] == float(is_opposite)


def test_a_guard_that_leaves_its_stop_has_forgotten_the_ticks_before():
    r = GuardRecord(2, 1e-3, library=None).numbers
    r[core.STOP], r[core.SINCE_STOP], r[core.USABLE] = core.STOP_PRESSED, r[core.DESCENT_S], 1.0
    r[core.HAS_SPEED] = r[core.HELD + 1] = r[core.V_FILTER + 1] = 1.0
    core.misses_too_many(r, core.CONTROL_MISSES, True)
    assert core.reset(r)
    assert [r[place] for place in (core.HAS_SPEED, core.HELD + 1, core.V_FILTER + 1)] == [0.0, 0.0, 0.0]
    assert r[core.CONTROL_MISSES] == r[core.CONTROL_MISSES + 1] == 0.0


@pytest.mark.parametrize(("slots", "moving"), [(11, 4), (7, 5)])
def test_a_dead_encoder_has_moved_clearly_and_then_stood_from_the_end_of_the_motion_to_now(slots: int, moving: int):
    way = 0.5
    for still_from in (moving, moving + 1):
        r = GuardRecord(1, 1e-3, library=None).numbers
        r[core.MOVING], r[core.LEAST_WAY] = moving, way
        for k in range(slots):  # the oldest first
            r[core.USED + k * core.JOINTS] = way if k >= still_from else 0.0
        assert core.is_dead(r, 0, slots - 1, slots) == (still_from == moving)


def kept_ticks(q: list[float], motor: list[float] | None, currents: list[float]) -> float:
    """Run of ticks in which one joint keeps all bits."""
    r = GuardRecord(1, 1e-3, library=None).numbers
    for k in range(len(q)):
        r[core.Q_IN], r[core.CURRENT_IN], r[core.IN_CURRENT] = q[k], currents[k], 1.0
        r[core.HAS_MOTOR], r[core.Q_MOTOR_IN] = (0.0, k) if motor is None else (1.0, motor[k])
        core.keep(r, 0)
    return r[core.KEPT_TICKS]


def test_a_signal_that_changes_ends_the_run_of_equal_bits_and_a_missing_or_broken_motor_encoder_does_not():
    still, moves = [0.5] * 9, [0.1 * k for k in range(9)]
    assert kept_ticks(still, still, still) == kept_ticks(still, None, still) == 8.0
    assert kept_ticks(still, [math.nan] * 9, still) == 8.0
    assert kept_ticks(moves, still, still) == kept_ticks(still, moves, still) == kept_ticks(still, still, moves) == 0.0


def test_an_image_whose_chance_is_just_at_the_limit_is_not_frozen():
    for chance, is_frozen in ((core.UNLIKELY, False), (0.99 * core.UNLIKELY, True)):
        r = GuardRecord(1, 1e-3, library=None).numbers
        r[core.FROZEN_MOST], r[core.KEPT_TICKS], r[core.KEPT_CHANCE] = 20.0, 50.0, chance
        assert core.is_frozen(r) == is_frozen


def test_each_check_of_the_largest_machine_writes_its_own_fields_only():
    """A wrong place of a joint's number shows where no place is free: with the largest number of joints."""
    own = {
        core.compare: (
            core.FAULTY, core.PARTED, core.WRONG, core.FIRST, core.PARTED_TICKS, core.STILL, core.LAST,
            core.MOTOR_THEN, core.OFF_TICKS, core.BIAS, *range(core.BEFORE, core.SIZE, core.JOINTS),
        ),
        core.is_frozen: (
            core.KEPT_TICKS, core.KEPT_SHARE, core.KEPT_CHANCE, core.KEPT_SEEN, core.TURNS, core.Q_KEPT,
            core.MOTOR_KEPT, core.TORQUE_KEPT, core.CHANGE_BEFORE,
        ),
        core.begin: (core.HELD, core.V_FILTER),
        core.filter_speeds: (core.V_FILTER, core.Q_FILTER, core.Q_SEEN, core.V_SEEN),
        core.act_on_comparison: (core.ISOLATED, core.POWERLESS, core.TAU_AT_STOP, core.PUSH_AT_STOP),
    }  # fmt: skip
    rng = np.random.default_rng(0)
    for check, fields in own.items():
        record = GuardRecord(core.JOINTS, 1e-3, library=None)
        set_monitors(record, [1.0] * core.JOINTS, True)
        record.numbers[core.HAS_MOTOR], record.numbers[core.TOLD_COUNT] = 1.0, record.numbers[core.SLOWEST]
        record.view[core.TORQUE_MAX : core.USED] = rng.uniform(0.5, 1.5, core.USED - core.TORQUE_MAX)
        before = record.view[core.TORQUE_MAX :].copy()
        check(record.numbers)
        changed = {core.TORQUE_MAX + k for k in np.flatnonzero(record.view[core.TORQUE_MAX :] != before)}
        assert changed, check.__name__
        foreign = changed - {place + j for place in fields for j in range(core.JOINTS)}
        assert not foreign, (check.__name__, sorted((place - core.TORQUE_MAX) // core.JOINTS for place in foreign))


@pytest.mark.parametrize(
    ("turns", "seen_before", "counts"),
    [
        (core.LEAST_TURNS, core.LEAST_SEEN, True),
        (0.99 * core.LEAST_TURNS, core.LEAST_SEEN, False),
        (core.LEAST_TURNS, core.LEAST_SEEN - 1.0, False),
    ],
)
def test_equal_bits_are_unlikely_from_the_least_noise_and_the_least_time_on(
    turns: float, seen_before: float, counts: bool
):
    r = GuardRecord(1, 1e-3, library=None).numbers
    r[core.IN_CURRENT], r[core.TURNS], r[core.KEPT_SHARE], r[core.KEPT_CHANCE] = 1.0, turns, 0.5, 1.0
    r[core.KEPT_SEEN], r[core.KEPT_TICKS] = seen_before, 0.0  # and this tick adds one to both
    core.keep(r, 0)
    assert r[core.KEPT_TICKS] == 1.0
    assert (r[core.KEPT_CHANCE] < 1.0) is counts


def test_a_wall_of_a_person_who_has_left_brakes_no_empty_machine():
    wanted = []
    for in_wall in (0.0, 1.0):
        envelope = Envelope(Limits(np.full(1, 30.0), np.full(1, 10.0)), 1e-3, library=None)
        r = envelope.record.numbers
        r[core.V], r[core.KNOWN], r[core.DESIRED], r[core.IN_WALL] = 0.1, 1.0, 0.02, in_wall
        envelope.record.tick.limit()
        wanted.append(r[core.WANTED])
    assert wanted == [0.02, 0.02]


def test_a_slow_joint_of_a_worn_machine_away_from_its_walls_is_not_braked():
    nothing = np.zeros((1, 3))
    table = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), np.ones(1), np.ones(1), np.ones(1))
    envelope = Envelope(Limits(np.full(1, 30.0), np.full(1, 10.0)), 1e-3, library=None)
    envelope.person = GuardedPerson(PersonLimits(table, np.full(1, 20.0), np.full(1, -3.0), np.full(1, 3.0)), 0.0)
    r = envelope.record.numbers
    r[core.V], r[core.KNOWN], r[core.DESIRED] = 0.1, 1.0, 0.02
    envelope.record.tick.limit()
    assert r[core.IN_WALL] == 0.0
    assert r[core.WANTED] == 0.02


def test_the_largest_machine_sees_a_jump_and_forgets_an_isolated_joint_whatever_other_joints_do():
    for joint in range(core.JOINTS):
        record = Ingress([1e-6] * core.JOINTS, 1e-3, 10.0).record
        r = record.numbers
        record.put(core.USED + int(r[core.USED_AT]) * core.JOINTS, 0.0)
        record.put(core.OVER, 1.0)  # the field before `IGNORED`
        r[core.T_IN] = 1e-3
        r[core.Q_IN + joint] = 0.5
        assert core.has_jumped(r)
        assert r[core.JUMPS + joint] == 1.0
        r[core.ISOLATED + joint] = 1.0
        core.ignore_isolated(r, int(r[core.USED_SLOTS]))
        used = [r[core.USED + slot * core.JOINTS + joint] for slot in range(int(r[core.USED_SLOTS]))]
        assert all(map(math.isnan, used))
