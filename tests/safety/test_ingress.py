"""Measurements that are non-finite, old, out of order, jumped or from a dead encoder are not used; all others are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.safety.ingress import FROZEN_MS, KEPT_JOINT_MS, KEPT_MS, Ingress, IngressResult
from exograv.safety.native.core import AGE_MAX_S, JUMPS_MAX
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

DT = 1e-3
V_TRIP = 5.0
JUMP = 1.5 * V_TRIP * DT
FINE = 1e-9
COUNT = 2 * np.pi / 2**14
"""Counts of a fine encoder, and of a coarse one [rad]."""


def state(k: int, q: list[float], current: float = 1.0, source: TorqueSource = TorqueSource.CURRENT) -> JointState:
    measured = np.full(len(q), current)
    nothing = np.full(len(q), np.nan)
    both = (measured, nothing) if source is TorqueSource.CURRENT else (nothing, measured)
    return JointState(k * DT, k, np.array(q), *both, source)


def seen(positions: list[list[float]], count: float = FINE) -> list[IngressResult]:
    ingress = Ingress([count] * len(positions[0]), DT, V_TRIP)
    return [ingress.see(state(k, q), k * DT) for k, q in enumerate(positions)]


@pytest.mark.parametrize("source", [TorqueSource.CURRENT, TorqueSource.JOINT_SENSOR])
def test_all_measurements_of_a_machine_without_faults_are_used(source: TorqueSource):
    ingress = Ingress([FINE, FINE], DT, V_TRIP)
    for k in range(100):
        one = state(k, [0.004 * k, -0.001 * k], source=source)
        assert ingress.see(one, k * DT + 0.002) == IngressResult(one)


@given(st.lists(st.floats(-4.9, 4.9), min_size=60, max_size=60), st.sampled_from([FINE, COUNT, 8 * COUNT]))
@settings(max_examples=40)
def test_no_motion_of_a_body_is_doubted_however_coarse_the_encoder(speeds: list[float], count: float):
    v, q, positions = 0.0, 0.0, []
    for wanted in np.repeat(speeds, 3):
        v += float(np.clip(wanted - v, -0.05, 0.05))  # 50 rad/s²: far more than a motor can do to an arm
        q += v * DT
        positions.append([count * round(q / count), 0.0])
    assert all(one.state is not None and not one.found for one in seen(positions, count))


def test_an_arm_at_rest_on_a_coarse_encoder_is_not_taken_for_a_dead_one():
    slow = [[COUNT * (k // 30), 0.0] for k in range(600)]
    assert not any(one.found for one in seen(slow, COUNT))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_non_finite_value_is_not_used_and_its_joint_is_named(bad: float):
    ingress = Ingress([FINE, FINE], DT, V_TRIP)
    assert ingress.see(state(0, [0.0, bad]), 0.0) == IngressResult(None, broken=frozenset({1}))
    assert ingress.see(state(1, [0.0, 0.0], current=bad), DT) == IngressResult(None, broken=frozenset({0, 1}))
    assert ingress.see(state(2, [0.0, 0.0]), 2 * DT).state is not None


def test_one_spike_is_passed_over_and_three_in_a_row_are_a_fault_of_their_joint():
    ingress = Ingress([FINE, FINE], DT, V_TRIP)
    ingress.see(state(0, [0.0, 0.0]), 0.0)
    assert ingress.see(state(1, [0.0, 0.5]), DT) == IngressResult(None)
    assert ingress.see(state(2, [0.0, 0.0]), 2 * DT).state is not None
    found = [ingress.see(state(k, [0.0, 0.5]), k * DT) for k in range(3, 3 + int(JUMPS_MAX))]
    assert found[-2] == IngressResult(None)
    assert found[-1] == IngressResult(None, ((StopReason.ENCODER_JUMPED, 1),))


def test_a_position_just_within_reach_is_no_jump_and_one_just_beyond_it_is():
    assert seen([[0.0, 0.0], [0.999 * JUMP, 0.0]])[1].state is not None
    assert seen([[0.0, 0.0], [1.001 * JUMP, 0.0]])[1].state is None


@pytest.mark.parametrize(("counts", "is_believed"), [(0.9, True), (1.1, False)])
def test_after_a_jump_a_joint_is_used_again_within_the_reach_of_the_fastest_joint_and_no_farther(
    counts: float, is_believed: bool
):
    way, count = V_TRIP * DT, 0.1 * V_TRIP * DT
    first, second = 1.5 * way + 1.2 * count, 2.0 * way + 0.5 * way + counts * count
    found = seen([[0.0, 0.0], [first, 0.0], [second, 0.0]], count)
    assert found[1].state is None
    assert (found[2].state is not None) is is_believed


def test_after_lost_ticks_a_joint_may_be_farther_away():
    ingress = Ingress([FINE], DT, V_TRIP)
    ingress.see(state(0, [0.0]), 0.0)
    assert ingress.see(None, DT) == IngressResult(None)
    assert ingress.see(state(2, [1.9 * JUMP]), 2 * DT).state is not None


def test_what_is_too_old_is_not_used_as_fresh():
    ingress = Ingress([FINE], DT, V_TRIP)
    assert ingress.see(state(1, [0.0]), DT + 1.001 * AGE_MAX_S) == IngressResult(None)
    assert ingress.see(state(2, [0.0]), 2 * DT + 0.999 * AGE_MAX_S).state is not None
    nameless = JointState(np.nan, 3, np.zeros(1), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)
    assert ingress.see(nameless, 3 * DT) == IngressResult(None)


@given(st.permutations(range(12)), st.lists(st.integers(0, 11), max_size=5))
def test_repeated_or_late_measurements_do_not_change_the_result_of_the_newest(order: list[int], twice: list[int]):
    arrivals = [state(k, [0.001 * k]) for k in [*order, *twice]]
    ingress, newest, used = Ingress([FINE], DT, V_TRIP), -1, []
    for one in arrivals:
        before = newest
        newest = max(newest, one.sequence)
        result = ingress.see(one, one.t)
        assert (result.state is None) == (one.sequence <= before)
        used += [result.state.sequence] if result.state is not None else []
    assert used == sorted(set(used))
    assert ingress.dropped == len(arrivals) - len(used)


@pytest.mark.parametrize("way", [0.0005, -0.0005])
def test_an_encoder_that_stops_dead_in_motion_is_found_after_twenty_ticks_and_not_before(way: float):
    moving = [[way * k, 0.0] for k in range(100)]
    stuck = [[moving[-1][0], 0.0]] * (FROZEN_MS + 5)
    found = seen(moving + stuck)
    first = next(k for k, one in enumerate(found) if one.found)
    assert found[first].found == ((StopReason.ENCODER_DEAD, 0),)
    assert first == len(moving) - 1 + FROZEN_MS
    assert found[first].state is not None


def test_a_joint_that_comes_to_rest_like_a_body_is_not_found():
    v, q, positions = 0.5, 0.0, []
    while v > 0.0:
        v -= 0.004  # 4 rad/s², by dry friction
        q += v * DT
        positions.append([COUNT * round(q / COUNT), 0.0])
    positions += [positions[-1]] * 100
    assert not any(one.found for one in seen(positions, COUNT))


@pytest.mark.parametrize("ahead", [1.001 * AGE_MAX_S, 1.0, np.inf])
def test_a_time_in_the_future_is_not_used_and_excuses_no_jump(ahead: float):
    ingress = Ingress([FINE], DT, V_TRIP)
    ingress.see(state(0, [0.0]), 0.0)
    future = JointState(DT + ahead, 1, np.array([0.5]), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)
    assert ingress.see(future, DT) == IngressResult(None)
    assert ingress.see(state(2, [0.5]), 2 * DT) == IngressResult(None)


@pytest.mark.parametrize("says_anything", [True, False])
def test_a_joint_that_is_trusted_again_has_no_history(says_anything: bool):
    ingress = Ingress([FINE], DT, V_TRIP)
    for k in range(50):
        ingress.see(state(k, [0.001 * k]), k * DT)
    ingress.see(state(50, [0.9]) if says_anything else None, 50 * DT, {0})
    for k in range(51, 51 + 2 * FROZEN_MS):
        one = state(k, [1.0])
        assert ingress.see(one, k * DT) == IngressResult(one)


def test_the_values_of_the_ignored_joint_and_of_no_other_are_not_checked():
    for ignored in range(3):
        for broken in range(3):
            ingress, q = Ingress([FINE] * 3, DT, V_TRIP), [0.0, 0.0, 0.0]
            q[broken] = np.nan
            result = ingress.see(state(0, q), 0.0, {ignored})
            assert (result.state is not None) == (ignored == broken)


BINARY = 2.0**-8
"""Encoder count whose multiples have no rounding errors [rad]."""


def test_a_measurement_exactly_at_its_limits_is_used():
    ingress = Ingress([FINE], DT, V_TRIP)
    assert ingress.see(state(0, [0.0]), AGE_MAX_S).state is not None
    assert ingress.see(state(1, [JUMP + FINE]), DT).state is not None


@pytest.mark.parametrize(("counts", "is_dead"), [(4, True), (3, False)])
def test_an_encoder_is_dead_after_a_way_of_four_counts_and_not_of_three(counts: int, is_dead: bool):
    moving = [[BINARY * max(k - 5 + counts, 0)] for k in range(6)]  # the last steps are one count each
    found = seen([[0.0]] * 30 + moving + [moving[-1]] * (FROZEN_MS + 2), BINARY)
    assert any(one.found for one in found) == is_dead


def test_a_joint_that_is_back_where_it_was_and_rests_is_not_dead():
    there_and_back = [[0.0], [0.004], [0.008], [0.004], [0.002]]
    assert not any(one.found for one in seen([*there_and_back, *[[0.0]] * (FROZEN_MS + 10)][:26]))


@pytest.mark.parametrize("count", [-1e-6, np.nan, -np.inf])
def test_an_invalid_encoder_count_is_refused(count: float):
    with pytest.raises(ConfigError, match="encoder of joint 1 has a count of"):
        Ingress([FINE, count], DT, V_TRIP)


def test_a_period_too_short_for_the_positions_of_twenty_five_milliseconds_is_refused():
    with pytest.raises(ConfigError, match=r"period is 0\.0001975 s; the guard needs at least 0\.000197 s"):
        Ingress([FINE], 1.975e-4, V_TRIP)
    Ingress([FINE], 1.99e-4, V_TRIP)  # these need all places of the ring


@pytest.mark.parametrize("count", [0.0, np.inf])
def test_an_exact_encoder_and_one_that_is_not_watched_are_taken(count: float):
    ingress = Ingress([count], DT, V_TRIP)
    ingress.see(state(0, [0.0]), 0.0)
    assert (ingress.see(state(1, [1.0]), DT).state is None) == (count == 0.0)


def imaged(
    frozen: list[int],
    noise: float = 0.05,
    step: float = 0.0,
    seconds: float = 2.0,
    way: float = 0.1,
    counts: tuple[float, ...] = (FINE, FINE, FINE),
) -> list[IngressResult]:
    """Return the checks of three joints whose image freezes at the end; `step` is the resolution of the currents."""
    rng, ingress, found = np.random.default_rng(8), Ingress(counts, DT, V_TRIP), []
    ticks, then = round(seconds / DT), (np.zeros(3), np.zeros(3))
    for k in range(ticks + 300):
        q = way * np.sin(0.02 * k * np.arange(1, 4) * DT)
        current = np.array([1.0, -0.5, 0.2]) + rng.normal(0.0, noise, 3) if noise else np.sin(0.01 * k) * np.ones(3)
        current = step * np.round(current / step) if step else current
        if k >= ticks:
            q[frozen], current[frozen] = then[0][frozen], then[1][frozen]
        then = q, current
        one = JointState(k * DT, k, q, current, np.full(3, np.nan), TorqueSource.CURRENT)
        found.append(ingress.see(one, k * DT))
    return found[ticks:]


@pytest.mark.parametrize("step", [0.0, 0.05], ids=["fine currents", "currents in steps of their noise"])
def test_a_machine_whose_image_freezes_counts_as_silent_after_forty_milliseconds(step: float):
    found = imaged([0, 1, 2], step=step)
    assert [one.state is not None for one in found[: KEPT_MS - 1]] == [True] * (KEPT_MS - 1)
    assert not any(one.state is not None for one in found[KEPT_MS - 1 :])
    assert not any(one.found for one in found)


def test_a_board_whose_image_freezes_alone_is_found_after_eighty_milliseconds():
    found = imaged([1])
    first = next(k for k, one in enumerate(found) if one.found)
    assert (first, found[first].found) == (KEPT_JOINT_MS - 1, ((StopReason.ENCODER_DEAD, 1),))


@pytest.mark.parametrize("frozen", [[0, 1, 2], [1]])
def test_a_machine_without_noise_may_stand_still_to_the_last_bit(frozen: list[int]):
    assert not any(one.found or one.state is None for one in imaged(frozen, noise=0.0))


@pytest.mark.parametrize("frozen", [[0, 1, 2], [0], [1]])
def test_a_machine_with_a_joint_that_is_not_watched_may_keep_all_its_bits(frozen: list[int]):
    results = imaged(frozen, seconds=0.5, way=0.0, counts=(FINE, np.inf, FINE))
    assert not any(one.found or one.state is None for one in results)


def test_a_machine_that_was_just_switched_on_is_not_judged_before_its_noise_is_known():
    assert not any(one.found for one in imaged([1], seconds=0.04)[: 2 * KEPT_JOINT_MS])


def test_quiet_sensors_with_coarse_steps_are_given_the_time_that_chance_needs():
    # Nine of ten values of such a current equal the one before, and 0.9 to the power of 219 is 1e-10.
    found = imaged([1], noise=0.03, step=0.3, seconds=5.0, way=0.0)
    first = next((k for k, one in enumerate(found) if one.found), None)
    assert first is None or first > 2 * KEPT_JOINT_MS
