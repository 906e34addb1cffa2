"""A fault's time counts while it shows, two faults have the sum of their budgets, and a pushed arm is not relaxed."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.campaigns.faults import judging
from exograv.campaigns.faults.acceptance import KnownMiss, Measure
from exograv.campaigns.faults.driver_faults import ALL
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.fault_plant import TruthSample
from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.figures import FaultFigures, HandCount
from exograv.campaigns.faults.judging import detection_begin
from exograv.campaigns.faults.known_misses import KNOWN_MISSES
from exograv.campaigns.faults.machine_faults import StuckEncoder, WeakMotor
from exograv.campaigns.faults.oracle import Judgement
from exograv.campaigns.faults.person_faults import PersonPush
from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict, _verdict, is_bad
from exograv.campaigns.faults.scenario_log import RELEASE_MS, ScenarioLog, TruthWatch
from exograv.safety.guard import SafeState
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
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
    assert (verdict.found["F08"], verdict.missed) == (14, ("F08",))


@pytest.mark.parametrize(
    ("braked", "missed", "unexplained"),
    [
        (ONSET + 10, (), ()),
        (ONSET + 25, ("F17",), ()),
        (ONSET + 31, ("F17",), ("F17",)),
        (None, ("F17",), ("F17",)),
    ],
)
def test_without_a_guard_it_counts_when_the_drives_brake_and_their_own_time_is_a_known_miss(
    braked: int | None, missed: tuple[str, ...], unexplained: tuple[str, ...]
):
    course = ScenarioLog(ticks=1000, braked_tick=braked)
    verdict = _verdict(Scenario(0, 0, ("F17",)), course, {"F17": ONSET}, {"F17": float(ONSET)}, True)
    assert (verdict.missed, verdict.unexplained) == (missed, unexplained)
    assert is_bad(verdict) == bool(unexplained)


def judged(name: str, course: ScenarioLog, relaxed: bool = True) -> ScenarioVerdict:
    return _verdict(Scenario(0, 0, (name,)), course, {name: ONSET}, {name: float(ONSET)}, relaxed)


@pytest.mark.parametrize(
    ("figures", "names"),
    [
        ({}, []),
        ({"extra_speed": 0.51}, ["extra_speed"]),
        ({"extra_way_deg": 3.1}, ["extra_way_deg"]),
        ({"flight_hand_m_s": 1.1, "injected_J": 0.6}, ["injected_J", "flight_hand_m_s"]),
    ],
)
def test_the_motion_that_a_fault_causes_is_judged_for_a_relaxed_arm(figures: dict[str, float], names: list[str]):
    course = replace(stopped(ONSET + 5, StopReason.ENCODER_DEAD), **figures)
    assert sorted(judged("F02", course).figures) == sorted(names)
    assert judged("F02", course).missed == (("F02",) if names else ())
    assert judged("F02", course, relaxed=False).missed == ()


def test_power_into_a_person_who_pushes_is_judged_for_every_wearer():
    assert judged("F29", ScenarioLog(ticks=1000, power_W=9.9), relaxed=False).figures == {}
    assert judged("F29", ScenarioLog(ticks=1000, power_W=10.1), relaxed=False).figures == {"power_W": 10.1}


def test_an_infinite_figure_is_missed_and_kept_without_a_number():
    figures = judged("F26", ScenarioLog(ticks=1000, gravity_torque_change_Nm_s=np.inf)).figures
    assert figures == {"gravity_torque_change_Nm_s": None}


@pytest.mark.parametrize(
    ("tick", "drift", "is_missed"), [(ONSET + 499, 20.0, False), (None, 4.9, False), (ONSET + 501, 5.1, True)]
)
def test_a_hidden_weight_may_either_be_found_or_hardly_move_the_arm(tick: int | None, drift: float, is_missed: bool):
    course = replace(stopped(tick, StopReason.TOO_FAST), drift_deg_s=drift)
    assert bool(judged("F28", course).missed) == is_missed
    assert not judged("F28", course, relaxed=False).missed


def test_a_miss_without_an_entry_is_new_and_one_beyond_its_bound_too(monkeypatch: pytest.MonkeyPatch):
    late = stopped(ONSET + 14, StopReason.DRIVE_FAULT)
    assert judged("F12", late).unexplained == ("F12",)
    for up_to, unexplained in ((13.0, ("F12",)), (14.0, ()), (None, ())):
        known = KnownMiss("F12", Measure.TIME, up_to, "A reason.")
        monkeypatch.setattr(judging, "KNOWN_MISSES", {("F12", Measure.TIME): known})
        assert judged("F12", late).unexplained == unexplained
        assert judged("F12", late).missed == ("F12",)
    monkeypatch.setattr(judging, "KNOWN_MISSES", {("F12", Measure.TIME): KnownMiss("F12", Measure.TIME, 14.0, "")})
    assert judged("F12", ScenarioLog(ticks=1000)).unexplained == ("F12",)


@pytest.mark.parametrize(
    ("hand_m_s", "unbalanced", "way_rad", "healthy_m_s", "unexplained"),
    [
        (1.2, 0.04, 1.5, 0.0, ()),  # 6.3 m/s · √0.04 = 1.26 m/s
        (1.3, 0.04, 1.5, 0.0, ("F48",)),
        (1.3, 0.04, 1.5, 0.4, ()),  # √(1.26² + 0.4²) = 1.32 m/s
        (1.4, 0.04, 1.5, 0.4, ("F48",)),
        (1.2, 0.16, 0.25, 0.0, ()),  # a quarter of the energy of a share that is four times as large
        (1.3, 0.16, 0.25, 0.0, ("F48",)),
        (1.1, 0.0, 1.5, 0.0, ("F48",)),
    ],
)
def test_an_arm_that_carries_the_wrong_weight_may_be_as_fast_as_its_fall_and_no_faster(
    hand_m_s: float, unbalanced: float, way_rad: float, healthy_m_s: float, unexplained: tuple[str, ...]
):
    course = stopped(ONSET + 5, StopReason.DRIFTED)
    of_fall = {"unbalanced": unbalanced, "way_rad": way_rad, "healthy_hand_m_s": healthy_m_s}
    course = replace(course, flight_hand_m_s=hand_m_s, **of_fall)
    verdict = judged("F48", course)
    assert (verdict.missed, verdict.unexplained) == (("F48",), unexplained)
    figures = figures_of([verdict]).by_fault["F48"]
    assert isinstance(figures, FaultFigures)
    figures = figures.misses["flight_hand_m_s"]
    assert figures.unexplained == len(unexplained)


def test_each_known_miss_is_of_a_criterion_that_its_fault_has_and_says_its_cause():
    for (name, measure), miss in KNOWN_MISSES.items():
        limit = ALL[name].budget_ms if measure is Measure.TIME else ALL[name].limits[measure]
        assert limit is not None
        assert miss.up_to is None or miss.up_to > limit
        assert len(miss.cause) > 40


PAIR = ("F12", "F16")  # Their budgets are 3 and 5 ms.


@pytest.mark.parametrize(("tick", "is_missed"), [(ONSET + 8, False), (ONSET + 9, True), (None, True)])
def test_two_faults_have_the_sum_of_their_budgets_from_the_first_on(tick: int | None, is_missed: bool):
    course = stopped(tick, StopReason.DRIVE_FAULT)
    begins = {"F12": float(ONSET), "F16": float(ONSET + 300)}
    verdict = _verdict(Scenario(0, 0, PAIR), course, dict.fromkeys(PAIR, ONSET), begins, True)
    assert bool(verdict.missed) == is_missed


def test_three_faults_have_the_sum_of_their_budgets_too():
    names = ("F12", "F16", "F39")  # 3, 5 and 2 ms
    begins: dict[str, float] = {name: float(ONSET) for name in names}
    for tick, is_missed in ((ONSET + 10, False), (ONSET + 11, True)):
        course = stopped(tick, StopReason.DRIVE_FAULT)
        verdict = _verdict(Scenario(0, 0, names), course, dict.fromkeys(names, ONSET), begins, True)
        assert bool(verdict.missed) == is_missed


@pytest.mark.parametrize(("tick", "unexplained"), [(ONSET + 300 + 5, ()), (ONSET + 300 + 6, ("F09", "F16"))])
def test_a_group_with_a_known_miss_is_explained_if_the_others_keep_their_budgets(
    tick: int, unexplained: tuple[str, ...]
):
    names = ("F09", "F16")
    begins = {"F09": float(ONSET), "F16": float(ONSET + 300)}
    course = stopped(tick, StopReason.CONTROL_SILENT)
    verdict = _verdict(Scenario(0, 0, names), course, dict.fromkeys(names, ONSET), begins, True)
    assert (verdict.missed, verdict.unexplained) == (names, unexplained)


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


def watched(count: int, onset: int, table: PlausibleTable | None = None, tau: float = 0.0) -> TruthWatch:
    """Watch of a flight without a stop, with a constant torque on joint 0 [N·m]."""
    watch = TruthWatch(onset, table=table)
    for tick in range(count):
        watch.pushed(False)
        watch.commanded(tick, np.array([tau, 0.0]), SafeState.NONE, None)
    watch.course.ticks = count
    return watch


def test_a_hand_counts_from_the_onset_on_without_any_stop():
    still, speeds = np.zeros(2), [3.0] * 5 + [0.2, 1.4, 0.3]
    sights = [TruthSample(still, still, speed, are_braking=False) for speed in speeds]
    course = watched(8, onset=5).finish(Judgement({}, np.zeros(8)), sights)
    assert (course.hand_m_s, course.flight_hand_m_s) == (0.0, 1.4)
    for relaxed, above in ((True, 1), (False, 0)):
        figures = figures_of([judged("F28", course, relaxed)])
        assert (figures.relaxed_hand_m_s.above, figures.relaxed_hand_every_flight_m_s.above) == (0, above)
        row = figures.by_fault["F28"]
        assert isinstance(row, FaultFigures)
        hands = row.hands
        assert isinstance(hands, HandCount)
        assert (hands.runs, hands.above) == (above, above)


def test_what_the_arm_does_without_the_fault_is_not_charged_to_the_fault():
    """The healthy arm is at t² degrees after t seconds, the arm with the fault at 4 t²."""
    fault, healthy = (
        [
            TruthSample(np.deg2rad([share * t**2, 0.0]), np.deg2rad([2.0 * share * t, 0.0]), 0.0, are_braking=False)
            for t in np.linspace(0.0, 1.0, 1001)
        ]
        for share in (4.0, 1.0)
    )
    course = watched(1001, onset=0).finish(Judgement({}, np.zeros(1001)), fault, healthy)
    assert course.extra_way_deg == pytest.approx(3.0)
    assert course.extra_speed == pytest.approx(np.deg2rad(6.0))
    assert course.drift_deg_s == pytest.approx((1.0 - 0.25) * 3.0 / 0.5)


def test_an_arm_that_the_fault_only_holds_is_not_moved_by_it():
    held, moving = (
        [TruthSample(np.deg2rad([rate * 1e-3 * k, 0.0]), np.deg2rad([rate, 0.0]), 0.0, False) for k in range(1001)]
        for rate in (0.0, 30.0)
    )
    course = watched(1001, onset=0).finish(Judgement({}, np.zeros(1001)), held, moving)
    assert (course.extra_speed, course.extra_way_deg, course.drift_deg_s) == (0.0, 0.0, 0.0)


def test_power_beyond_carrying_and_friction_is_counted_and_braking_is_not():
    """A table without weight: 0.5 N·m of friction, 3 N·m along a motion of 2 rad/s give (3 − 0.5) · 2 W."""
    nothing = np.zeros((2, Features(2, 2).count))
    table = PlausibleTable((LimbTable((0, 1), 2, nothing, nothing),), np.zeros(2), np.full(2, 0.5), np.zeros(2))
    for tau, power in ((3.0, 5.0), (0.4, 0.0), (-3.0, 0.0)):
        sights = [TruthSample(np.zeros(2), np.array([2.0, 0.0]), 0.0, are_braking=False)] * 100
        course = watched(100, 0, table, tau).finish(Judgement({}, np.zeros(100)), sights)
        assert course.power_W == pytest.approx(power)
        assert course.injected_J == pytest.approx(0.1 * power)


def test_a_diverged_twin_is_a_failure_of_its_own_in_the_row_of_its_fault():
    crashed = judged("F29", ScenarioLog(ticks=500, crashed="TwinDivergedError: velocity", diverged=True))
    figures = figures_of([crashed, judged("F29", ScenarioLog(ticks=1000))])
    row = figures.by_fault["F29"]
    assert isinstance(row, FaultFigures)
    assert (figures.ok, figures.diverged, row.diverged) == (False, 1, 1)


def test_the_way_of_a_fall_ends_with_the_fastest_hand():
    v = np.array([-2.0, 0.5])
    sights = [TruthSample(np.zeros(2), v, float(tick == 249), are_braking=False) for tick in range(500)]
    course = watched(500, onset=0).finish(Judgement({}, np.zeros(500)), sights)
    assert course.way_rad == pytest.approx(0.5)


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
    fault = StuckEncoder(np.random.default_rng(0), 2, 0)
    fault.joint = 1
    for speeds, begin in (
        ([0.3] * 20 + [0.0] * 480, np.inf),
        ([0.3] * 20 + [0.0] * 200 + [-0.3] * 280, 220.0),
        ([0.3] * 40 + [0.0] * 460, 0.0),
        ([0.19] * 500, np.inf),
    ):
        moves = flown(speeds).moves
        assert not moves[:, 0].any()
        shows = fault.shows(np.zeros(moves.shape), moves, NOISE_NM)
        assert detection_begin(none, FAULTS["F02"], shows) == begin


def test_a_push_ends():
    push = PersonPush(np.random.default_rng(0), 2, ONSET)
    assert [push.pushes(tick) for tick in (ONSET - 1, ONSET, ONSET + push.lasts - 1, ONSET + push.lasts)] == [
        False,
        True,
        True,
        False,
    ]
