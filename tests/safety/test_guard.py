"""Late, wrong or dead control and false encoders lead to bounded outputs, and the arm comes down."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.safety.envelope import Envelope
from exograv.safety.guard import (
    GRAVITY_LEVEL_S,
    IN_SECOND_MAX,
    IN_WINDOW_MAX_MS,
    ControlRequest,
    Guard,
    Guarded,
    SafeState,
)
from exograv.safety.ingress import FROZEN_MS, Ingress
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

DT = 1e-3
LIMITS = Limits(np.array([60.0, 30.0]), np.array([10.0, 4.0]))
STEP = LIMITS.torque_rate_max_Nm_per_s * DT
ROUNDING = 1e-9
TORQUE = np.array([10.0, -3.0])
LIFE_S = 0.005
BUDGET_TICKS = 6
"""Budget of F04 and F14 in ticks of 1 kHz, from the first missed tick to the safe state."""


class Bench:
    """Guard with a machine that moves as commanded, and a control that answers."""

    def __init__(self):
        self.guard = Guard(Envelope(LIMITS, DT), Ingress([1e-6, 1e-6], DT, LIMITS.v_trip_rad_s), DT)
        self.k, self.q, self.v = 0, np.array([0.3, 0.6]), np.zeros(2)

    def state(self, q: np.ndarray | None = None) -> JointState:
        q = self.q if q is None else q
        return JointState(self.k * DT, self.k, q.copy(), np.ones(2), np.full(2, np.nan), TorqueSource.CURRENT)

    def tick(self, tau: np.ndarray | None = TORQUE, q: np.ndarray | None = None, *, lost: bool = False) -> Guarded:
        """Run one tick with control's torque or without, and with the true position, another one or none."""
        self.k += 1
        self.q = self.q + self.v * DT
        now = self.k * DT
        submitted = None if tau is None else ControlRequest(self.k, now + LIFE_S, tau)
        return self.guard.step(None if lost else self.state(q), submitted, now)

    def settled(self, ticks: int = 100) -> "Bench":
        for _ in range(ticks):
            self.tick()
        return self


def test_without_faults_control_s_torque_goes_out_unchanged():
    out = Bench().settled().tick()
    np.testing.assert_array_equal(out.tau, TORQUE)
    assert out.safe_state is SafeState.NONE
    assert not out.drive_damping.any()


def test_a_checked_measurement_is_handed_to_control():
    bench = Bench()
    measured = bench.state()
    assert bench.guard.see(measured, 0.0) is measured
    assert bench.guard.see(measured, 0.0) is None
    assert bench.guard.see(None, DT) is None


def test_before_control_has_answered_nothing_is_held():
    outs = [Bench().tick(None), Bench().tick(lost=True)]
    assert [out.tau.tolist() for out in outs] == [[0.0, 0.0]] * 2


def test_a_guard_that_has_seen_nothing_is_not_reset():
    bench = Bench()
    bench.guard.press_stop()
    assert not bench.guard.reset()


def test_an_answer_is_valid_until_the_end_of_its_life_and_not_after_it():
    bench = Bench().settled()
    bench.k += 1
    now, measured = bench.k * DT, bench.state()
    assert ControlRequest(bench.k, now, TORQUE).answers(measured, now)
    assert not ControlRequest(bench.k, float(np.nextafter(now, 0.0)), TORQUE).answers(measured, now)
    assert not ControlRequest(bench.k - 1, now, TORQUE).answers(measured, now)


def test_an_answer_that_expires_while_the_guard_waits_for_it_is_not_used():
    bench = Bench().settled()
    bench.k += 1
    now = bench.k * DT
    assert bench.guard.see(bench.state(), now) is not None
    out = bench.guard.decide(ControlRequest(bench.k, now + 0.0001, 2.0 * TORQUE), now + 0.0002)
    assert out.safe_state is SafeState.BRIDGE


def test_an_answer_is_used_at_the_very_end_of_its_life():
    bench = Bench().settled()
    bench.k += 1
    now = bench.k * DT
    assert bench.guard.step(bench.state(), ControlRequest(bench.k, now, TORQUE), now).safe_state is SafeState.NONE


def test_a_reset_is_possible_from_the_tick_on_in_which_the_descent_is_over():
    dt, ticks = 2.0**-10, 128  # a power of two, so that sums have no rounding
    limits = replace(LIMITS, descent_s=ticks * dt)
    guard = Guard(Envelope(limits, dt), Ingress([1e-6, 1e-6], dt, LIMITS.v_trip_rad_s), dt)
    guard.press_stop()
    nothing, zero = np.full(2, np.nan), np.zeros(2)
    resets = []
    for k in range(ticks):
        guard.step(JointState(k * dt, k, zero, np.ones(2), nothing, TorqueSource.CURRENT), None, k * dt)
        resets.append(guard.reset())
    assert resets == [False] * (ticks - 1) + [True]


@pytest.mark.parametrize(("speed", "is_left"), [(0.05, False), (-0.05, False), (0.0499, True)])
def test_a_joint_stands_below_the_speed_limit_of_a_reset_and_not_at_it(speed: float, is_left: bool):
    bench = Bench().settled()
    bench.guard.press_stop()
    bench.settled(round(LIMITS.descent_s / DT) + 1)
    bench.guard.envelope.record.put(core.V_SEEN, np.array([0.0, speed]))
    assert bench.guard.reset() is is_left


@pytest.mark.parametrize("isolated", [0, 1])
def test_a_reset_waits_for_the_trusted_joint_to_stand_and_not_for_the_isolated_one(isolated: int):
    for moving in (0, 1):
        bench = Bench().settled()
        bench.guard.envelope.trip(StopReason.ENCODER_DEAD, isolate=(isolated,))
        bench.settled(round(LIMITS.descent_s / DT) + 1)
        bench.guard.envelope.record.numbers[core.V_SEEN + moving] = 1.0
        assert bench.guard.reset() is (moving == isolated)


def test_a_torque_for_a_measurement_that_has_not_come_yet_is_never_used():
    bench = Bench().settled()
    bench.k += 1
    ahead = ControlRequest(bench.k + 1, (bench.k + 9) * DT, 2.0 * TORQUE)
    assert bench.guard.step(bench.state(), ahead, bench.k * DT).safe_state is SafeState.BRIDGE
    out = bench.tick(None)
    assert out.safe_state is SafeState.BRIDGE
    np.testing.assert_array_equal(out.tau, TORQUE)


@pytest.mark.parametrize(("last", "state"), [(19, SafeState.DESCENT), (20, SafeState.BRIDGE)])
def test_misses_are_counted_over_twenty_ticks_and_no_more(last: int, state: SafeState):
    bench = Bench().settled()
    misses = (0, 6, 12, last)
    outs = [bench.tick(None if k in misses else TORQUE) for k in range(last + 1)]
    assert outs[-1].safe_state is state


def test_three_silent_ticks_are_bridged_and_the_fourth_lets_the_arm_down():
    bench = Bench().settled()
    bridged = [bench.tick(None) for _ in range(IN_WINDOW_MAX_MS)]
    assert all(out.safe_state is SafeState.BRIDGE for out in bridged)
    assert all((out.tau == TORQUE).all() for out in bridged)
    out = bench.tick(None)
    assert out.safe_state is SafeState.DESCENT
    assert bench.guard.envelope.stop is StopReason.CONTROL_SILENT
    assert IN_WINDOW_MAX_MS + 1 <= BUDGET_TICKS


def test_four_misses_in_twenty_ticks_are_too_many_though_never_two_in_a_row():
    bench = Bench().settled()
    for _ in range(3):
        bench.tick(None)
        assert bench.tick().safe_state is SafeState.NONE
    assert bench.tick(None).safe_state is SafeState.DESCENT


def test_one_percent_of_a_second_missed_is_too_many_though_never_four_in_twenty():
    bench = Bench().settled()
    for _ in range(IN_SECOND_MAX):
        assert bench.tick(None).safe_state is SafeState.BRIDGE
        bench.settled(10)
    assert bench.tick(None).safe_state is SafeState.DESCENT


def test_a_miss_every_hundred_and_tenth_tick_is_bridged_for_ever():
    bench = Bench().settled()
    for _ in range(30):
        assert bench.tick(None).safe_state is SafeState.BRIDGE
        bench.settled(109)
    assert bench.guard.envelope.stop is None


@pytest.mark.parametrize("of_before", [True, False])
def test_an_answer_that_has_expired_or_is_to_another_measurement_is_not_used(of_before: bool):
    bench = Bench().settled()
    bench.k += 1
    now = bench.k * DT
    other = (
        ControlRequest(bench.k - 1, now + LIFE_S, TORQUE) if of_before else ControlRequest(bench.k, now - DT, TORQUE)
    )
    out = bench.guard.step(bench.state(), other, now)
    assert out.safe_state is SafeState.BRIDGE


def test_a_machine_that_falls_silent_is_braked_by_its_drives_within_six_ticks():
    bench = Bench().settled()
    outs = [bench.tick(lost=True) for _ in range(BUDGET_TICKS)]
    assert [out.safe_state for out in outs[:3]] == [SafeState.BRIDGE] * 3
    assert outs[-1].safe_state is SafeState.ISOLATION
    np.testing.assert_array_equal(outs[-1].drive_damping, LIMITS.damping_Nms_per_rad)
    assert bench.guard.envelope.stop is StopReason.MACHINE_SILENT


def test_a_silent_encoder_is_isolated_and_the_other_joint_is_still_watched_and_damped():
    bench = Bench().settled()
    broken = np.array([np.nan, 0.6])
    outs = [bench.tick(q=broken) for _ in range(4)]
    assert [out.safe_state for out in outs] == [SafeState.BRIDGE] * 3 + [SafeState.ISOLATION]
    assert bench.guard.envelope.isolated == {0}
    assert np.isfinite([out.tau for out in outs]).all()
    out = [bench.tick(q=np.array([np.nan, 0.6 + 0.001 * k])) for k in range(200)][-1]
    assert out.drive_damping.tolist() == [10.0, 0.0]
    falling = -3.0 * (1 - 0.2 / 3.0) - 4.0 * 1.0
    assert out.tau[1] == pytest.approx(falling, abs=0.2)


@pytest.mark.parametrize("broken", [(0,), (1,), (0, 1)])
def test_joints_without_a_position_are_isolated_with_their_reason_and_no_other_ones(broken: tuple[int, ...]):
    bench = Bench().settled()
    q = bench.q.copy()
    q[list(broken)] = np.nan
    for _ in range(4):
        bench.tick(q=q)
    assert bench.guard.envelope.isolated == set(broken)
    assert bench.guard.envelope.stop is StopReason.NO_MEASUREMENT


def test_a_spike_changes_no_torque_by_more_than_a_step_and_three_isolate_the_joint():
    bench = Bench().settled()
    spike = bench.q + np.array([0.0, 0.4])
    out = bench.tick(q=spike)
    assert (np.abs(out.tau - TORQUE) <= STEP).all()
    assert bench.tick().safe_state is SafeState.NONE
    outs = [bench.tick(q=spike) for _ in range(3)]
    assert outs[-1].safe_state is SafeState.ISOLATION
    assert bench.guard.envelope.isolated == {1}
    assert bench.guard.envelope.stop is StopReason.ENCODER_JUMPED


def test_an_encoder_that_dies_in_motion_is_isolated_within_thirty_ticks():
    bench = Bench()
    bench.v = np.array([0.5, 0.2])
    bench.settled()
    dead = bench.q[0]
    ticks = 0
    while bench.guard.envelope.stop is None:
        bench.tick(q=np.array([dead, bench.q[1] + 0.2 * DT]))
        ticks += 1
    assert FROZEN_MS <= ticks <= 30
    assert bench.guard.envelope.isolated == {0}
    assert bench.guard.envelope.stop is StopReason.ENCODER_DEAD


def test_of_two_faults_the_worse_state_is_in_force_and_the_first_reason_stays():
    bench = Bench().settled()
    for _ in range(4):
        bench.tick(None)
    spike = bench.q + np.array([0.4, 0.0])
    out = [bench.tick(None, q=spike) for _ in range(3)][-1]
    assert out.safe_state is SafeState.ISOLATION
    assert bench.guard.envelope.stop is StopReason.CONTROL_SILENT


def test_a_wrong_motor_torque_leads_to_damping_without_a_model_twice_as_hard():
    bench = Bench().settled()
    bench.guard.envelope.trip(StopReason.TORQUE_WRONG, without_model=True)
    bench.v = np.array([0.5, 0.0])
    out = [bench.tick() for _ in range(400)][-1]
    assert out.safe_state is SafeState.DAMPING
    np.testing.assert_allclose(out.tau, [-2.0 * 10.0 * 0.5, 0.0], atol=0.01)


def test_only_a_reset_after_the_descent_at_rest_leaves_the_latch():
    bench = Bench().settled()
    for _ in range(4):
        bench.tick(None)
    assert bench.guard.reset() is False
    out = [bench.tick(np.array([50.0, 20.0])) for _ in range(3100)][-1]
    assert out.safe_state is SafeState.DESCENT
    assert not out.tau.any()
    bench.v = np.array([0.2, 0.0])
    bench.settled(50)
    assert bench.guard.reset() is False
    bench.v = np.zeros(2)
    bench.settled(50)
    assert bench.guard.reset()
    out = bench.tick()
    assert out.safe_state is SafeState.NONE
    assert (np.abs(out.tau) <= STEP + ROUNDING).all()


def test_after_a_silence_a_reset_needs_measurements_that_show_the_machine_at_rest():
    bench = Bench().settled()
    for _ in range(3100):
        bench.tick(lost=True)
    assert bench.guard.envelope.isolated == {0, 1}
    assert bench.guard.reset() is False
    bench.v = np.array([0.0, 0.2])
    bench.settled(50)
    assert bench.guard.reset() is False
    bench.v = np.zeros(2)
    bench.settled(50)
    assert bench.guard.reset()


numbers = st.one_of(st.floats(-1e3, 1e3), st.sampled_from([np.nan, np.inf, -np.inf, 1e308]))
pairs = st.tuples(numbers, numbers).map(np.array)
near = st.tuples(st.floats(-0.002, 0.002), st.floats(-0.002, 0.002)).map(np.array)


@given(st.lists(st.tuples(st.none() | pairs, st.one_of(near, pairs), st.booleans()), min_size=1, max_size=60))
@settings(max_examples=60)
def test_for_any_input_the_output_is_finite_bounded_slow_and_never_less_safe_than_before(history):
    bench = Bench().settled(20)
    before, worst = bench.guard.envelope.limit(TORQUE, bench.q, np.zeros(2)), SafeState.NONE
    for tau, off, lost in history:
        out = bench.tick(tau, bench.q + off, lost=lost)
        assert np.isfinite(out.tau).all()
        assert (np.abs(out.tau) <= LIMITS.torque_max_Nm).all()
        assert (np.abs(out.tau - before) <= STEP + ROUNDING).all()
        assert np.isfinite(out.drive_damping).all()
        if worst >= SafeState.DESCENT:
            assert out.safe_state >= worst
        before, worst = out.tau, max(worst, out.safe_state)


def test_machine_and_control_silent_in_turns_hold_no_torque_longer_than_one_of_them():
    bench = Bench().settled()
    assert bench.tick(lost=True).safe_state is SafeState.BRIDGE
    assert bench.tick(None).safe_state is SafeState.BRIDGE
    assert bench.tick(lost=True).safe_state is SafeState.BRIDGE
    assert bench.tick(None).safe_state is SafeState.DESCENT


def test_an_isolated_joint_is_trusted_again_after_a_reset_at_any_position():
    bench = Bench().settled()
    spike = bench.q + np.array([0.0, 0.4])
    for _ in range(3):
        bench.tick(q=spike)
    bench.q = bench.q - np.array([0.0, 0.5])
    for _ in range(3010):
        bench.tick()
    assert bench.guard.reset()
    assert all(bench.tick().safe_state is SafeState.NONE for _ in range(60))


def test_a_model_that_control_has_lost_lets_the_arm_down():
    bench = Bench().settled()
    bench.guard.lose_model()
    assert bench.tick().safe_state is SafeState.DESCENT
    assert bench.guard.envelope.stop is StopReason.MODEL_LOST


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("way", [-1.0, 1.0])
@pytest.mark.parametrize(("beyond", "speed", "is_found"), [(3.1, 0.05, True), (2.9, 0.05, False), (3.1, 0.15, False)])
def test_a_slow_joint_asked_for_far_more_than_may_go_out_stops_as_another_arm(
    beyond: float, speed: float, is_found: bool, side: float, way: float
):
    bench = Bench()
    bench.v = np.array([0.0, way * speed])
    asked = np.array([0.0, side * (LIMITS.torque_max_Nm[1] + beyond)])
    outs = [bench.tick(asked) for _ in range(700)]
    stopped = bench.guard.envelope.stop is StopReason.NOT_THIS_ARM
    assert stopped == is_found
    assert [out.safe_state for out in outs].count(SafeState.NONE) == (300 if is_found else 700)


def test_short_excessive_requests_are_forgotten_and_a_descent_does_not_count():
    bench, much, little = Bench(), np.array([80.0, 0.0]), np.zeros(2)
    for _ in range(10):
        for asked, ticks in ((much, 100), (little, 300)):
            for _ in range(ticks):
                bench.tick(asked)
    assert bench.guard.envelope.stop is None
    bench.guard.press_stop()
    for _ in range(3010):
        bench.tick(TORQUE)
    assert bench.guard.reset()
    assert all(bench.tick(TORQUE).safe_state is SafeState.NONE for _ in range(500))


def test_an_untried_machine_may_be_asked_for_any_torque():
    bench = Bench()
    bench.guard = Guard.of_machine(Envelope(LIMITS, DT), DT, [2.0, 0.5], is_known=False)
    for _ in range(1500):
        bench.tick(np.array([80.0, 0.0]))  # its currents report another torque
    assert bench.guard.envelope.stop is None


@pytest.mark.parametrize("is_known", [True, False])
def test_encoders_of_a_calibrated_machine_are_checked_and_those_of_an_untried_one_are_not(is_known: bool):
    bench = Bench()
    bench.guard = Guard.of_machine(Envelope(LIMITS, DT), DT, is_known=is_known)
    bench.settled()
    for _ in range(3):
        bench.tick(q=bench.q + np.array([0.4, 0.0]))
    assert (bench.guard.envelope.stop is StopReason.ENCODER_JUMPED) == is_known


def worn(level: float) -> tuple[Bench, GuardedPerson]:
    """Return a bench with a person for whom any torque is plausible."""
    bench, nothing, wide = Bench(), np.zeros((2, 9)), np.full(2, 60.0)
    table = PlausibleTable((LimbTable((0, 1), 2, nothing, nothing),), wide, wide, wide)
    person = bench.guard.envelope.person = GuardedPerson(
        PersonLimits(table, wide, np.full(2, -3.0), np.full(2, 3.0)), level
    )
    return bench, person


@pytest.mark.parametrize(("before", "wanted"), [(0.0, 0.0313), (0.7, 0.65), (0.3, 0.3), (1.0, 0.99)])
def test_a_gravity_level_is_reached_exactly_by_a_ramp_no_steeper_than_the_operator_s(before: float, wanted: float):
    bench, person = worn(before)
    assert bench.guard.feel(wanted)
    felt = [before]
    for _ in range(round(abs(wanted - before) * GRAVITY_LEVEL_S / DT) + 2):
        bench.tick()
        felt.append(person.gravity_level)
    assert np.abs(np.diff(felt)).max() <= DT / GRAVITY_LEVEL_S + ROUNDING
    assert felt[-1] == wanted
    assert all(min(before, wanted) <= level <= max(before, wanted) for level in felt)


@pytest.mark.parametrize("level", [np.nan, np.inf, -0.001, 1.001])
def test_an_invalid_gravity_level_changes_nothing(level: float):
    bench, person = worn(0.5)
    assert bench.guard.feel(level) is False
    bench.settled()
    assert person.gravity_level == 0.5


def test_a_stop_ends_a_gravity_ramp_at_its_level_and_no_level_is_accepted_while_latched():
    bench, person = worn(0.0)
    assert bench.guard.feel(1.0)
    bench.settled()
    bench.guard.press_stop()
    reached = person.gravity_level
    assert 0.0 < reached < 1.0
    assert bench.guard.feel(0.0) is False
    for _ in range(round((LIMITS.descent_s + 0.1) / DT)):
        bench.tick()
    assert bench.guard.reset()
    bench.settled()
    assert person.gravity_level == reached


def test_a_level_that_a_session_sets_ends_a_ramp():
    bench, person = worn(0.5)
    assert bench.guard.feel(1.0)
    bench.settled(10)
    person.gravity_level = 0.3
    bench.settled(10)
    assert person.gravity_level == 0.3


def test_a_gravity_ramp_ends_when_the_person_leaves():
    bench, person = worn(0.5)
    assert bench.guard.feel(1.0)
    bench.guard.envelope.person = None
    bench.settled()
    bench.guard.envelope.person = person
    bench.settled()
    assert person.gravity_level == 0.5


def test_no_gravity_level_is_accepted_without_a_person_or_while_control_moves_the_arm():
    bench, person = worn(0.0)
    person.drive(True)
    assert bench.guard.feel(0.5) is False
    person.drive(False)
    assert all(bench.guard.feel(level) for level in (0.0, 1.0, 0.5))
    assert Bench().guard.feel(0.5) is False


@pytest.mark.parametrize(("ramp_s", "ticks"), [(0.0, 500), (0.1, 500), (0.5, 500), (2.0, 2000)])
def test_a_ramp_to_a_gravity_level_may_be_slower_than_the_operator_s_and_no_faster(ramp_s: float, ticks: int):
    bench, person = worn(0.5)
    assert bench.guard.feel(0.6, ramp_s)
    for _ in range(ticks - 5):
        bench.tick()
    assert 0.59 < person.gravity_level < 0.6
    for _ in range(10):
        bench.tick()
    assert person.gravity_level == 0.6


@pytest.mark.parametrize(("before", "wanted"), [(0.5, 0.4), (0.5, 0.6), (0.9, 1.0)])
def test_a_slow_ramp_takes_its_time_in_either_direction(before: float, wanted: float):
    bench, person = worn(before)
    assert bench.guard.feel(wanted, 0.9)
    bench.settled(450)
    assert person.gravity_level == pytest.approx(0.5 * (before + wanted), abs=0.001)
    bench.settled(451)
    assert person.gravity_level == wanted


@pytest.mark.parametrize("ramp_s", [-1.0, np.nan, np.inf])
def test_a_ramp_of_no_duration_is_refused(ramp_s: float):
    bench, person = worn(0.5)
    assert bench.guard.feel(0.6, ramp_s) is False
    bench.settled()
    assert person.gravity_level == 0.5
