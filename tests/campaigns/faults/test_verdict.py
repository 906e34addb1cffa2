"""A fault's time counts while it shows, two faults have the sum of their budgets, and a pushed arm is not relaxed."""

import numpy as np
import pytest

from exograv.campaigns.faults.fault_plant import TruthSample
from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.judging import detection_begin
from exograv.campaigns.faults.machine_faults import WeakMotor
from exograv.campaigns.faults.oracle import Judgement
from exograv.campaigns.faults.person_faults import PersonPush
from exograv.campaigns.faults.scenario import Scenario, _verdict
from exograv.campaigns.faults.scenario_log import RELEASE_MS, ScenarioLog, TruthWatch
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

ONSET = 100
NOISE_NM = np.full(2, 0.4)


def stopped(tick: int | None, reason: StopReason, state: SafeState = SafeState.ISOLATION) -> ScenarioLog:
    since = {} if tick is None else {each: tick for each in SafeState if SafeState.NONE < each <= state}
    return ScenarioLog(ticks=1000, stopped_tick=tick, reason=None if tick is None else reason, since=since)


def weak_motor() -> WeakMotor:
    fault = WeakMotor(np.random.default_rng(0), 2, ONSET)
    fault.joint, fault.share = 1, 0.0
    return fault


def told(*stretches: tuple[int, float]) -> np.ndarray:
    """Torque told to joint 1 in stretches of (ticks, torque [N·m])."""
    column = np.concatenate([np.full(count, torque) for count, torque in stretches])
    return np.stack([np.full_like(column, 20.0), column], axis=1)


def weak_begin(course: ScenarioLog, torque: np.ndarray) -> float:
    fault = weak_motor()
    return detection_begin(course, FAULTS["F11"], fault.shows(torque, np.zeros(torque.shape, bool), NOISE_NM))


def test_a_weak_motors_time_begins_when_it_is_told_more_than_noise_can_hide():
    course = stopped(615, StopReason.TORQUE_WRONG, SafeState.DAMPING)
    assert weak_begin(course, told((600, 4.0), (400, -5.0))) == 600
    assert weak_begin(course, told((600, 9.0), (400, 9.0))) == ONSET


def test_a_weak_motor_that_is_told_too_little_is_not_missed_and_one_that_is_told_enough_is():
    none = stopped(None, StopReason.TORQUE_WRONG)
    for torque, missed in (
        (told((1000, 4.0)), ()),
        (told((300, 4.0), (20, 9.0), (680, 4.0)), ()),
        (told((1000, 9.0)), ("F11",)),
    ):
        begins = {"F11": weak_begin(none, torque)}
        assert _verdict(Scenario(0, 0, ("F11",)), none, {"F11": ONSET}, begins, True).missed == missed


@pytest.mark.parametrize(("tick", "missed"), [(ONSET + 2, ()), (ONSET + 5, ("F12",))])
def test_a_single_fault_has_its_own_budget(tick: int, missed: tuple[str, ...]):
    course = stopped(tick, StopReason.DRIVE_FAULT)
    assert _verdict(Scenario(0, 0, ("F12",)), course, {"F12": ONSET}, {"F12": float(ONSET)}, True).missed == missed


def test_the_time_runs_to_the_right_state_and_not_to_the_first_one():
    course = stopped(ONSET, StopReason.TOO_FAST, SafeState.DESCENT)
    course.since[SafeState.ISOLATION] = ONSET + 14
    verdict = _verdict(Scenario(0, 0, ("F08",)), course, {"F08": ONSET}, {"F08": float(ONSET)}, True)
    assert (verdict.found["F08"], verdict.missed) == (14, ())


@pytest.mark.parametrize(("braked", "missed"), [(ONSET + 25, ()), (ONSET + 31, ("F17",)), (None, ("F17",))])
def test_without_a_guard_it_counts_when_the_drives_brake(braked: int | None, missed: tuple[str, ...]):
    course = ScenarioLog(ticks=1000, braked_tick=braked)
    assert _verdict(Scenario(0, 0, ("F17",)), course, {"F17": ONSET}, {"F17": float(ONSET)}, True).missed == missed


PAIR = ("F12", "F16")  # Their budgets are 3 and 5 ms.


@pytest.mark.parametrize(("tick", "is_missed"), [(ONSET + 8, False), (ONSET + 9, True), (None, True)])
def test_two_faults_have_the_sum_of_their_budgets_from_the_first_on(tick: int | None, is_missed: bool):
    course = stopped(tick, StopReason.DRIVE_FAULT)
    begins = {"F12": float(ONSET), "F16": float(ONSET + 300)}
    verdict = _verdict(Scenario(0, 0, PAIR), course, dict.fromkeys(PAIR, ONSET), begins, True)
    assert bool(verdict.missed) == is_missed


def test_two_faults_of_which_none_has_to_be_found_are_never_missed():
    pair = ("F06", "F29")
    course = stopped(None, StopReason.TOO_FAST)
    begins: dict[str, float] = {name: float(ONSET) for name in pair}
    assert _verdict(Scenario(0, 0, pair), course, dict.fromkeys(pair, ONSET), begins, True).missed == ()


def test_the_hand_of_one_who_pushes_is_told_apart():
    watch, still = TruthWatch(0), np.zeros(2)
    for tick, is_pushed in enumerate([False, True, *[False] * (RELEASE_MS + 1)]):
        watch.pushed(is_pushed)
        watch.commanded(tick, still, SafeState.DESCENT, StopReason.STOP_PRESSED)
        watch.course.ticks += 1
    speeds = [0.1, 3.0, *[2.0] * RELEASE_MS, 0.4]
    sights = [TruthSample(still, still, speed, are_braking=False) for speed in speeds]
    course = watch.finish(Judgement({}, np.zeros(len(sights))), sights)
    assert (course.hand_m_s, course.pushed_hand_m_s) == (0.4, 3.0)


def flown(speeds: list[float]) -> TruthWatch:
    """Watch of a flight in which one joint has these speeds and the other stands still, with a fault from tick 0 on."""
    watch = TruthWatch(0)
    for tick in range(len(speeds)):
        watch.pushed(False)
        watch.commanded(tick, np.zeros(2), SafeState.NONE, None)
        watch.course.ticks += 1
    sights = [TruthSample(np.zeros(2), np.array([0.0, speed]), 0.0, are_braking=False) for speed in speeds]
    watch.finish(Judgement({}, np.zeros(len(sights))), sights)
    return watch


def test_what_shows_in_motion_is_not_asked_for_where_the_joint_has_come_to_rest_again():
    none = stopped(None, StopReason.ENCODERS_PART)
    for speeds, begin in (
        ([0.3] * 20 + [0.0] * 480, np.inf),
        ([0.3] * 20 + [0.0] * 200 + [-0.3] * 280, 220.0),
        ([0.3] * 40 + [0.0] * 460, 0.0),
        ([0.19] * 500, np.inf),
    ):
        moves = flown(speeds).moves
        assert not moves[:, 0].any()
        assert detection_begin(none, FAULTS["F02"], moves[:, 1]) == begin


def test_a_push_ends():
    push = PersonPush(np.random.default_rng(0), 2, ONSET)
    assert [push.pushes(tick) for tick in (ONSET - 1, ONSET, ONSET + push.lasts - 1, ONSET + push.lasts)] == [
        False,
        True,
        True,
        False,
    ]
