"""Torques stay near the plausible torque of this person, away from stops, and within the tank, for any request."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.errors import ConfigError
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native import core
from exograv.safety.native.core import MARGIN_NM, SHARE_MAX, V_CREDIBLE_RAD_S, WALL_AHEAD_S
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.stops import StopReason

DT = 1e-3
MACHINE = Limits(np.array([60.0, 60.0]), np.array([10.0, 4.0]))
STEP = MACHINE.torque_rate_max_Nm_per_s * DT
ROUNDING = 1e-9
ARM_NM, EXO_NM = np.array([10.0, 3.0]), np.array([5.0, 1.0])
DRY, VISCOUS, ERROR = np.array([2.0, 1.0]), np.array([0.5, 0.2]), np.array([0.05, 0.02])
ACTIVE = np.array([8.0, 4.0])
STILL = np.zeros(2)


def sine(weight: np.ndarray) -> np.ndarray:
    """Table of two joints that carry nothing of each other: weight · sin q."""
    table = np.zeros((2, 9))
    # The order is that of `Features`: 1, cos and sin of the first joint, then these times those of the second.
    table[0, 2], table[1, 6] = weight
    return table


TABLE = PlausibleTable((LimbTable((0, 1), 2, sine(EXO_NM), sine(ARM_NM)),), ERROR, DRY, VISCOUS)
LIMITS = PersonLimits(TABLE, ACTIVE, np.full(2, -2.0), np.full(2, 2.0))


def worn(gravity_level: float = 0.0, limits: PersonLimits = LIMITS, machine: Limits = MACHINE) -> Envelope:
    envelope = Envelope(machine, DT)
    envelope.person = GuardedPerson(limits, gravity_level)
    return envelope


def held(tau: np.ndarray, q: np.ndarray, v: np.ndarray, gravity_level: float = 0.0, limits: PersonLimits = LIMITS):
    """Return the output with a torque rate that is practically unlimited."""
    return worn(gravity_level, limits, replace(MACHINE, torque_rate_max_Nm_per_s=1e6)).limit(tau, q, v)


def plausible(q: np.ndarray, gravity_level: float = 0.0) -> np.ndarray:
    return (EXO_NM + (1.0 - gravity_level) * ARM_NM) * np.sin(q)


def bounds(q: np.ndarray, v: np.ndarray, gravity_level: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of both rows of the table in docs/explanation/safety.md, written a second time."""
    p, f = plausible(q, gravity_level), DRY + VISCOUS * np.abs(v) + ERROR
    down, up = np.minimum(p, 0.0), np.maximum(p, 0.0)
    low = np.maximum(SHARE_MAX * down - f - MARGIN_NM, down - f - ACTIVE)
    return low, np.minimum(SHARE_MAX * up + f + MARGIN_NM, up + f + ACTIVE)


inside = arrays(float, 2, elements=st.floats(-1.8, 1.8))
anywhere = arrays(float, 2, elements=st.floats(-2.03, 2.03))
slow = arrays(float, 2, elements=st.floats(-3.9, 3.9))
wild = arrays(float, 2, elements=st.one_of(st.floats(-1e3, 1e3), st.floats(allow_nan=True, allow_infinity=True)))
levels = st.floats(0.0, 1.8)


def test_a_person_is_weightless_not_driven_and_in_no_wall_by_default():
    person = GuardedPerson(LIMITS)
    assert (person.gravity_level, person.is_driven, person.energy_J) == (0.0, False, LIMITS.tank_start_J)
    person.look([0.0, 0.0], [0.0, 0.0])
    assert not person.is_in_a_wall


WALLS = np.array([LIMITS.q_lower + LIMITS.wall_rad, LIMITS.q_upper - LIMITS.wall_rad])


@given(arrays(float, 2, elements=st.floats(-2.2, 2.2)), arrays(float, 2, elements=st.floats(-5.0, 5.0)))
@example(WALLS[0], np.zeros(2))
@example(WALLS[1], np.zeros(2))
@example(np.nextafter(WALLS[0], -9.0), np.zeros(2))
@example(np.nextafter(WALLS[1], 9.0), np.zeros(2))
@example(WALLS[0] - 0.01, np.ones(2))
@example(WALLS[1] + 0.01, -np.ones(2))
def test_a_person_is_in_a_wall_exactly_if_near_a_stop_now_or_in_a_tenth_of_a_second(q: np.ndarray, v: np.ndarray):
    person = GuardedPerson(LIMITS)
    person.look(q.tolist(), v.tolist())
    near = [(at < WALLS[0]) | (at > WALLS[1]) for at in (q, q + 0.1 * v)]
    assert person.is_in_a_wall == bool(np.any(near))


@given(inside, wild, levels)
def test_no_torque_stays_outside_what_is_plausible_for_the_person(q: np.ndarray, tau: np.ndarray, level: float):
    out = held(tau, q, STILL, level)
    low, high = bounds(q, STILL, level)
    assert (low - ROUNDING <= out).all()
    assert (out <= high + ROUNDING).all()


@given(st.lists(st.tuples(anywhere, slow, wild), min_size=2, max_size=40), levels)
def test_no_history_jumps_or_leaves_the_drives_limits(history, level: float):
    envelope, before = worn(level), np.zeros(2)
    for q, v, tau in history:
        out = envelope.limit(tau, q, v)
        assert np.isfinite(out).all()
        assert (np.abs(out - before) <= STEP + ROUNDING).all()
        assert (np.abs(out) <= MACHINE.torque_max_Nm).all()
        before = out


@given(inside, levels)
def test_carrying_machine_and_arm_passes_unchanged_and_costs_nothing(q: np.ndarray, level: float):
    envelope = worn(level, machine=replace(MACHINE, torque_rate_max_Nm_per_s=1e6))
    tau, person = plausible(q, level), envelope.person
    assert person is not None
    for _ in range(3):
        np.testing.assert_allclose(envelope.limit(tau, q, np.array([0.2, -0.2])), tau, atol=ROUNDING)
    assert person.energy_J == pytest.approx(LIMITS.tank_start_J, abs=1e-12)


def test_a_body_weight_typed_ten_times_too_high_is_held_to_a_little_over_the_arm():
    q = np.array([1.2, 0.8])
    out = held(10.0 * plausible(q), q, STILL)
    over = out - plausible(q)
    assert (over <= 0.3 * plausible(q) + MARGIN_NM + DRY + ERROR + ROUNDING).all()
    assert (over <= ACTIVE + DRY + ERROR + ROUNDING).all()


def test_above_one_gravity_the_arm_may_be_pushed_down_with_its_share_and_below_it_may_not():
    q, down = np.array([1.5, 0.0]), np.array([-40.0, 0.0])
    heavy = held(down, q, STILL, 1.8)[0]
    light = held(down, q, STILL)[0]
    assert heavy == pytest.approx(bounds(q, STILL, 1.8)[0][0])
    assert light == pytest.approx(-MARGIN_NM - DRY[0] - ERROR[0])
    assert heavy < light


@given(st.floats(0.0, 0.1745), st.sampled_from([-1.0, 1.0]))
def test_in_the_wall_before_a_stop_nothing_pushes_on_and_motion_to_it_is_braked(depth: float, side: float):
    limits = replace(
        LIMITS, table=replace(TABLE, chains=(LimbTable((0, 1), 2, 0.0 * sine(EXO_NM), 0.0 * sine(ARM_NM)),))
    )
    q = np.array([side * (2.0 - 0.1745 + depth), 0.0])
    push = held(np.array([side * 50.0, 0.0]), q, STILL, limits=limits)[0]
    free = MARGIN_NM + DRY[0] + ERROR[0]
    assert side * push == pytest.approx(free * (1.0 - depth / math.radians(10.0)), abs=0.01)
    towards = held(STILL, q, np.array([side * 0.3, 0.0]), limits=limits)[0]
    away = held(STILL, q, np.array([-side * 0.3, 0.0]), limits=limits)[0]
    soon = min((depth + 0.3 * WALL_AHEAD_S) / math.radians(10.0), 1.0)
    assert side * towards == pytest.approx(-0.3 * 10.0 * soon, abs=0.01)
    assert away == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("in_wall", [0, 1])
def test_a_joint_far_from_its_stops_may_push_while_another_one_is_in_a_wall(in_wall: int, side: float):
    ends = np.full(2, side * 0.5), np.full(2, side * 2.5)  # all positions have the same sign
    limits = replace(LIMITS, q_lower=np.minimum(*ends), q_upper=np.maximum(*ends))
    q = np.full(2, side * 1.5)
    q[in_wall] = side * 0.55
    low, high = bounds(q, STILL)
    for tau, bound in ((np.full(2, 50.0), high), (np.full(2, -50.0), low)):
        assert held(tau, q, STILL, limits=limits)[1 - in_wall] == pytest.approx(bound[1 - in_wall])


@pytest.mark.parametrize("q", [np.array([2.04, 0.0]), np.array([0.0, -2.04])])
def test_a_joint_past_its_stop_starts_the_descent(q: np.ndarray):
    envelope = worn()
    envelope.limit(STILL, np.array([2.03, -2.03]), STILL)
    assert envelope.stop is None
    envelope.limit(STILL, q, STILL)
    assert envelope.stop is StopReason.PAST_A_STOP


def test_a_lost_position_starts_the_descent_and_leaves_the_last_posture_in_force():
    envelope, q = worn(), np.array([1.2, 0.8])
    tau = np.array([envelope.limit(plausible(q), q, STILL) for _ in range(150)])[-1]
    out = envelope.limit(plausible(q), np.array([np.nan, 0.8]), STILL)
    assert envelope.stop is StopReason.NO_MEASUREMENT
    np.testing.assert_allclose(out, tau, atol=STEP)


@given(st.lists(st.tuples(wild, arrays(float, 2, elements=st.floats(-0.1, 0.1))), min_size=10, max_size=120))
def test_the_tank_is_never_overdrawn_where_speed_is_that_of_a_body(history):
    envelope, v, q = worn(), np.zeros(2), np.zeros(2)
    person = envelope.person
    assert person is not None
    for tau, change in history:
        v = np.clip(v + change, -3.9, 3.9)
        q = np.clip(q + v * DT, -1.8, 1.8)
        envelope.limit(tau, q, v)
        assert person.energy_J >= -TANK_DEBT_J
        assert person.energy_J <= LIMITS.tank_max_J


TANK_DEBT_J = 0.02
"""Energy that the tank may be overdrawn while torque falls at its rate and the joint still gains speed."""


def test_a_push_that_follows_every_motion_ends_with_the_tank():
    envelope, v, into, q, out = worn(), np.array([1.0, 0.0]), 0.0, np.zeros(2), np.zeros(2)
    for _ in range(800):
        out = envelope.limit(np.array([50.0, 0.0]), q, v)
        into += DT * (out[0] - DRY[0] - VISCOUS[0]) * v[0] if out[0] > DRY[0] + VISCOUS[0] else 0.0
    assert into <= LIMITS.tank_start_J + TANK_DEBT_J
    assert out[0] == pytest.approx(DRY[0] + VISCOUS[0], abs=0.05)


def test_braking_fills_the_tank_to_its_cap_and_no_farther():
    envelope, v = worn(), np.array([3.0, 0.0])
    for _ in range(150):
        envelope.limit(np.array([-10.0, 0.0]), np.zeros(2), v)
    assert envelope.person is not None
    assert envelope.person.energy_J == LIMITS.tank_max_J


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"q_upper": np.array([2.0, -1.9])}, "Joint 1 moves from -2.0 to -1.9"),
        ({"q_lower": np.array([np.nan, -2.0])}, "Joint 0 moves from nan"),
        ({"active_max_Nm": np.array([0.0, 4.0])}, "active_max_Nm"),
        ({"tank_start_J": 2.0}, "tank_start_J is 2.0; allowed: above 0 and up to tank_max_J, 1.0"),
        ({"tank_start_J": 0.0}, "tank_start_J is 0.0"),
    ],
)
def test_invalid_limits_are_refused(change: dict, word: str):
    with pytest.raises(ConfigError) as error:
        replace(LIMITS, **change)
    assert word in str(error.value)


@pytest.mark.parametrize("level", [np.nan, -np.inf, np.inf])
def test_a_non_finite_gravity_level_lifts_no_bound_and_spoils_no_tank(level: float):
    envelope, q = worn(level, machine=replace(MACHINE, torque_rate_max_Nm_per_s=1e6)), np.array([1.2, 0.8])
    out = envelope.limit(np.array([60.0, 60.0]), q, STILL)
    assert (out <= bounds(q, STILL, 1.8 if level > 0.0 else 0.0)[1] + ROUNDING).all()
    assert envelope.person is not None
    assert envelope.person.energy_J == LIMITS.tank_start_J


def test_an_energy_that_is_not_a_number_counts_as_an_empty_tank():
    q, v, push = np.zeros(2), np.array([1.0, 0.0]), np.array([3.0, 0.0])
    given = []
    for energy in (math.nan, 0.0):
        envelope = worn()
        assert envelope.person is not None
        envelope.begin(plausible(q))
        envelope.person.energy_J = energy
        given.append(envelope.limit(plausible(q) + push, q, v).tolist())
    assert given[0] == given[1]
    assert np.isfinite(given[0]).all()


def test_at_rest_and_braking_an_overdrawn_tank_takes_nothing_away():
    envelope = worn()
    assert envelope.person is not None
    envelope.person.energy_J = -0.01
    for v in (STILL, np.array([0.5, 0.5])):
        brake = np.array([-0.1, -0.1])
        np.testing.assert_allclose(envelope.limit(brake, np.zeros(2), v), brake, atol=ROUNDING)


def test_a_person_keeps_energy_and_level_on_the_way_out_of_a_machine_and_into_another_one():
    first, second = worn(0.3), Envelope(MACHINE, DT)
    person = first.person
    assert person is not None
    first.limit(STILL, np.array([1.9, 0.0]), STILL)
    assert person.is_in_a_wall
    person.energy_J = 0.2
    first.person = None
    assert (person.energy_J, person.gravity_level) == (0.2, 0.3)
    first.limit(STILL, np.array([3.0, 0.0]), STILL)
    assert first.stop is None, "an empty machine has no stops of a person"
    second.person = person
    assert (person.energy_J, person.gravity_level) == (0.2, 0.3)
    second.limit(STILL, np.array([3.0, 0.0]), STILL)
    assert second.stop is StopReason.PAST_A_STOP


@pytest.mark.parametrize("moving", [0, 1])
def test_a_joint_at_rest_keeps_its_torque_while_another_one_has_no_energy_to_push(moving: int):
    v, tau = np.zeros(2), np.array([4.0, 3.0])
    v[moving] = 1.0
    envelope = worn(machine=replace(MACHINE, torque_rate_max_Nm_per_s=1e6))
    assert envelope.person is not None
    envelope.person.energy_J = 0.0
    out = envelope.limit(tau, np.zeros(2), v)
    assert out[1 - moving] == tau[1 - moving]
    assert out[moving] == pytest.approx((DRY + VISCOUS)[moving])


def test_an_incredible_speed_lifts_no_bound_and_empties_no_tank():
    envelope = worn(machine=replace(MACHINE, torque_rate_max_Nm_per_s=1e6))
    out = envelope.limit(STILL, np.zeros(2), np.array([1e308, 0.0]))
    assert out[0] == pytest.approx(bounds(np.zeros(2), STILL)[0][0])
    assert envelope.person is not None
    assert envelope.person.energy_J == LIMITS.tank_start_J


def test_a_joint_exactly_at_the_trip_is_not_past_its_stop():
    limits = replace(LIMITS, trip_rad=0.25)
    person = GuardedPerson(limits)
    for q, is_past in (([2.25, -2.25], False), ([2.25 + 1e-9, 0.0], True), ([0.0, -2.25 - 1e-9], True)):
        person.look(q, [0.0, 0.0])
        assert person.is_past_a_stop == is_past


def test_limits_just_inside_their_ranges_are_accepted():
    limits = replace(LIMITS, tank_start_J=1.0, tank_max_J=1.0, trip_rad=0.0)
    assert GuardedPerson(limits).energy_J == 1.0


@pytest.mark.parametrize(
    "change",
    [
        {"active_max_Nm": np.array([8.0, np.inf])},
        {"active_max_Nm": np.array([np.nan, 4.0])},
        {"path_W": -0.1},
        {"path_W": np.inf},
        {"path_W": np.nan},
        {"driven_W": -0.1},
        {"driven_J": np.inf},
        {"v_trip_rad_s": 0.0},
        {"v_trip_rad_s": np.nan},
        {"tank_max_J": np.inf},
        {"tank_max_J": np.nan},
        {"wall_rad": 0.25, "q_upper": np.full(2, -1.5)},
        {"wall_rad": 0.0},
        {"wall_rad": -0.1},
        {"trip_rad": -0.1},
        {"trip_rad": np.inf},
        {"trip_rad": np.nan},
    ],
)
def test_limits_just_outside_their_ranges_are_refused(change: dict):
    with pytest.raises(ConfigError):
        replace(LIMITS, **change)


def test_a_joint_with_a_small_range_between_two_walls_is_accepted():
    replace(LIMITS, wall_rad=0.25, q_upper=np.full(2, -1.45))


def test_a_person_s_own_speed_limit_starts_the_descent_before_the_machine_s():
    for speed, is_stopped in ((1.4, False), (1.6, True)):
        envelope = worn(limits=replace(LIMITS, v_trip_rad_s=1.5))
        envelope.limit(STILL, np.zeros(2), np.array([0.0, -speed]))
        assert (envelope.stop is StopReason.TOO_FAST) == is_stopped
    envelope = worn(limits=replace(LIMITS, v_trip_rad_s=9.0))
    envelope.limit(STILL, np.zeros(2), np.array([0.0, 5.1]))
    assert envelope.stop is StopReason.TOO_FAST


def test_a_driven_person_has_a_larger_tank_and_a_released_one_the_tank_of_floating():
    envelope = worn(limits=replace(LIMITS, driven_W=2.0, driven_J=3.0))
    person = envelope.person
    assert person is not None
    for _ in range(10):
        envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == LIMITS.tank_start_J
    person.drive(True)
    assert person.energy_J == 3.0
    person.energy_J = 1.0
    person.drive(True)
    for _ in range(100):
        envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == pytest.approx(1.0 + 2.0 * 100 * DT)
    for _ in range(2000):
        envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == 3.0
    person.drive(False)
    assert person.energy_J == LIMITS.tank_start_J
    person.energy_J = 0.1
    person.drive(False)
    envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == 0.1


def test_on_a_path_the_tank_fills_by_its_power_to_its_cap():
    envelope = worn(limits=replace(LIMITS, path_W=2.0))
    person = envelope.person
    assert person is not None
    for _ in range(100):
        envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == pytest.approx(LIMITS.tank_start_J + 2.0 * 100 * DT)
    for _ in range(400):
        envelope.limit(STILL, np.zeros(2), STILL)
    assert person.energy_J == LIMITS.tank_max_J


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_thrown_at_a_stop_is_caught_before_the_trip_even_while_control_pushes(side: float):
    # An elbow with a kilogram in the hand, at the speed at which a restless wearer threw it (demo, level 2, seed 0).
    inertia, q, v = 0.25, np.array([0.0, side * 1.2]), np.array([0.0, side * 2.7])
    nothing = 0.0 * sine(EXO_NM)
    weightless = replace(TABLE, chains=(LimbTable((0, 1), 2, nothing, nothing),))
    envelope = worn(limits=replace(LIMITS, table=weightless))
    for _ in range(1000):
        tau = envelope.limit(np.array([0.0, side * 10.0]), q, v)
        friction = DRY[1] * np.tanh(v[1] / 0.02)
        v = v + np.array([0.0, DT * (tau[1] - friction) / inertia])
        q = q + DT * v
        assert envelope.stop is None


def test_before_the_first_tick_a_person_is_bounded_as_at_zero_and_at_rest():
    at_zero = GuardedPerson(LIMITS)
    at_zero.look([0.0, 0.0], [0.0, 0.0])
    assert GuardedPerson(LIMITS).bounded([60.0, -60.0]) == at_zero.bounded([60.0, -60.0])
    assert not GuardedPerson(LIMITS).is_past_a_stop
    assert not GuardedPerson(LIMITS).is_driven


def test_the_friction_of_a_joint_counts_up_to_the_greatest_credible_speed_and_not_beyond_it():
    far = replace(LIMITS, q_lower=np.full(2, -1e4), q_upper=np.full(2, 1e4))
    for speed, counts in ((V_CREDIBLE_RAD_S, True), (1.001 * V_CREDIBLE_RAD_S, False)):
        envelope = worn(limits=far)
        envelope.limit(np.zeros(2), STILL, np.array([speed, 0.0]))
        assert envelope.person is not None
        most = envelope.person.bounded([1e6, 0.0])[0]
        assert most == pytest.approx(bounds(STILL, np.array([speed * counts, 0.0]))[1][0])


def test_power_beyond_carrying_stays_within_its_limit_at_the_present_speed():
    envelope = worn(limits=replace(LIMITS, power_max_W=1.0, tank_start_J=50.0, tank_max_J=50.0))
    v = np.full(len(LIMITS.q_lower), 1.5)
    q = 0.5 * (LIMITS.q_lower + LIMITS.q_upper)
    tau = np.zeros_like(v)
    for _ in range(200):
        tau = envelope.limit(np.full_like(v, 20.0), q, v)
    record = envelope.record
    over = np.maximum(tau - record.of(core.CARRIED) - record.of(core.FRICTION), 0.0)
    assert over @ v == pytest.approx(1.0)


def test_braking_fades_before_a_joint_turns_back():
    """Torque in the direction of motion after a rebound, with and without the limit of power."""

    def torque_after_rebound(power_max_W: float) -> float:
        machine = replace(MACHINE, torque_rate_max_Nm_per_s=150.0)
        envelope = worn(limits=replace(LIMITS, power_max_W=power_max_W), machine=machine)
        q = 0.5 * (LIMITS.q_lower + LIMITS.q_upper)
        tau = np.zeros_like(q)
        for speed in [*[3.9] * 200, *np.linspace(3.9, -3.9, 20)]:
            v = np.zeros_like(q)
            v[0] = speed
            tau = envelope.limit(np.where(v != 0.0, -20.0, 0.0), q, v)
        return float(envelope.record.of(core.CARRIED)[0] - tau[0])

    assert torque_after_rebound(2.0) < 0.8 * torque_after_rebound(math.inf)


def test_a_level_that_is_set_is_there_at_once_and_no_ramp_goes_on():
    nothing = np.zeros((1, 3))
    table = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), *[np.zeros(1)] * 3)
    person = GuardedPerson(PersonLimits(table, np.ones(1), np.full(1, -3.0), np.full(1, 3.0)), 1.0)
    r = person._record.numbers
    r[core.LEVEL_WANTED], r[core.LEVEL_STEP], r[core.LEVEL_MOVES] = 0.0, 0.01, 1.0
    person.gravity_level = 0.4
    assert (r[core.LEVEL], r[core.LEVEL_WANTED], r[core.LEVEL_MOVES]) == (0.4, 0.4, 0.0)
