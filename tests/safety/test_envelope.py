"""The torque that reaches a person is finite, bounded and slow, for all requests of control and all encoder values."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.errors import ConfigError
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason

DT = 1e-3
LIMITS = Limits(np.array([60.0, 60.0, 30.0, 30.0]), np.array([10.0, 10.0, 4.0, 4.0]))
RATE = LIMITS.torque_rate_max_Nm_per_s * DT
ROUNDING = 1e-9  # N·m, for sums of torques below 100 N·m
STILL = np.zeros(4)
TORQUE = np.array([20.0, -12.0, 3.0, 8.0])

anything = st.floats(allow_nan=True, allow_infinity=True)
likely = st.floats(-100.0, 100.0)
torques = arrays(float, 4, elements=st.one_of(likely, anything))
speeds = arrays(float, 4, elements=st.one_of(st.floats(-8.0, 8.0), anything))
histories = st.lists(st.tuples(torques, speeds, st.booleans()), min_size=1, max_size=40)


def held(envelope: Envelope, tau: np.ndarray, v: np.ndarray, ticks: int) -> np.ndarray:
    """Return the output after a number of equal ticks."""
    return np.array([envelope.limit(tau, STILL, v) for _ in range(ticks)])[-1]


def settled(tau: np.ndarray = TORQUE) -> Envelope:
    """Return an envelope that has reached a torque of at most 25 N·m."""
    envelope = Envelope(LIMITS, DT)
    held(envelope, tau, STILL, round(25.0 / RATE) + 2)
    return envelope


@given(history=histories)
def test_no_history_gives_a_torque_that_is_infinite_beyond_the_limit_or_a_jump(history):
    envelope, before = Envelope(LIMITS, DT), np.zeros(4)
    for tau_desired, v, operator_resets in history:
        if operator_resets:
            envelope.reset()
        tau = envelope.limit(tau_desired, STILL, v)
        assert np.isfinite(tau).all()
        assert (np.abs(tau) <= LIMITS.torque_max_Nm).all()
        assert (np.abs(tau - before) <= RATE + ROUNDING).all()
        before = tau


@given(history=histories)
def test_a_stop_stays_until_reset(history):
    envelope = Envelope(LIMITS, DT)
    reason = None
    for tau_desired, v, _ in history:
        envelope.limit(tau_desired, STILL, v)
        assert reason is None or envelope.stop is reason
        reason = envelope.stop


@given(tau=arrays(float, 4, elements=st.floats(-25.0, 25.0)), v=arrays(float, 4, elements=st.floats(-3.9, 3.9)))
@settings(max_examples=25)
def test_a_torque_within_the_limits_passes_unchanged(tau: np.ndarray, v: np.ndarray):
    envelope = settled(tau)
    clipped = envelope.clipped_ticks
    np.testing.assert_array_equal(envelope.limit(tau, STILL, v), tau)
    assert envelope.stop is None
    assert envelope.clipped_ticks == clipped


@pytest.mark.parametrize(
    ("tau", "v", "reason"),
    [
        (np.full(4, np.nan), STILL, StopReason.NOT_FINITE),
        (np.array([0.0, np.inf, 0.0, 0.0]), STILL, StopReason.NOT_FINITE),
        (TORQUE, np.array([0.0, 0.0, 0.0, np.nan]), StopReason.NO_MEASUREMENT),
        (TORQUE, np.array([0.0, -np.inf, 0.0, 0.0]), StopReason.NO_MEASUREMENT),
    ],
)
def test_a_fault_starts_a_descent_that_ends_within_three_seconds_and_begins_without_a_drop(tau, v, reason):
    envelope = settled()
    envelope.limit(tau, STILL, v)
    assert envelope.stop is reason
    descent = np.array([envelope.limit(tau, STILL, STILL) for _ in range(round(LIMITS.descent_s / DT))])
    # The torque is never simply switched off: half of it is left half-way.
    half_way = descent[len(descent) // 2]
    np.testing.assert_allclose(half_way, 0.5 * TORQUE, rtol=0.02)
    np.testing.assert_allclose(descent[-1], 0.0, atol=RATE)


def test_a_lost_velocity_does_not_stop_the_descent():
    envelope = settled()
    lost = np.full(4, np.nan)
    descent = np.array([envelope.limit(lost, STILL, lost) for _ in range(3001)])
    np.testing.assert_allclose(descent[1500], 0.5 * TORQUE, rtol=0.01)
    np.testing.assert_array_equal(descent[-1], 0.0)


def test_the_descent_damps_every_motion():
    envelope = settled()
    envelope.limit(np.full(4, np.nan), STILL, STILL)
    v = np.array([1.0, -1.0, 0.5, -0.5])
    np.testing.assert_allclose(held(envelope, TORQUE, v, 3200), -LIMITS.damping_Nms_per_rad * v)


@given(v=arrays(float, 4, elements=st.floats(-4.9, 4.9)))
def test_motion_above_four_radians_per_second_is_braked_and_slower_motion_is_not(v: np.ndarray):
    envelope = Envelope(LIMITS, DT)
    tau = held(envelope, STILL, v, 5)
    fast = np.abs(v) > LIMITS.v_damping_rad_s
    assert (tau[fast] * v[fast] < 0.0).all()
    assert not tau[~fast].any()
    assert envelope.stop is None


def test_after_a_reset_torque_goes_on_from_the_descent():
    envelope = settled()
    envelope.limit(np.full(4, np.nan), STILL, STILL)
    before = envelope.limit(TORQUE, STILL, STILL)
    envelope.reset()
    assert envelope.stop is None
    np.testing.assert_allclose(envelope.limit(TORQUE, STILL, STILL), before, atol=RATE)


def test_a_caller_that_overwrites_its_torque_does_not_move_the_limits():
    envelope, other = settled(), settled()
    envelope.limit(TORQUE, STILL, STILL)[:] = 1e9
    other.limit(TORQUE, STILL, STILL)
    np.testing.assert_array_equal(envelope.limit(-TORQUE, STILL, STILL), other.limit(-TORQUE, STILL, STILL))


def test_clipped_ticks_are_counted():
    envelope = Envelope(LIMITS, DT)
    for _ in range(10):
        envelope.limit(np.full(4, 100.0), STILL, STILL)
    assert envelope.clipped_ticks == 10


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["torque_max_Nm", "damping_Nms_per_rad"])
def test_an_invalid_limit_of_one_joint_is_refused(name: str, bad: float):
    with pytest.raises(ConfigError, match=rf"envelope\.{name} of joint 2 is {bad}; it must be positive and finite"):
        replace(LIMITS, **{name: np.array([1.0, 1.0, bad, 1.0])})


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["torque_rate_max_Nm_per_s", "v_damping_rad_s", "v_trip_rad_s", "descent_s"])
def test_an_invalid_limit_of_all_joints_is_refused(name: str, bad: float):
    with pytest.raises(ConfigError, match=rf"envelope\.{name} is {bad}; it must be positive and finite"):
        replace(LIMITS, **{name: bad})


def test_a_joint_exactly_at_the_speed_limit_does_not_trip():
    envelope = Envelope(LIMITS, DT)
    envelope.limit(STILL, STILL, np.full(4, LIMITS.v_trip_rad_s))
    assert envelope.stop is None


def test_a_joint_at_the_speed_limit_keeps_its_motor_and_a_faster_one_is_left_to_its_drive():
    envelope, trip = Envelope(LIMITS, DT), LIMITS.v_trip_rad_s
    envelope.limit(STILL, STILL, np.array([trip, 1.001 * trip, -trip, -1.001 * trip]))
    assert envelope.powerless == {1, 3}


def test_the_descent_is_over_after_its_time_and_never_before_a_fault():
    dt, ticks = 2.0**-10, 128  # a power of two, so that sums have no rounding
    envelope = Envelope(replace(LIMITS, descent_s=ticks * dt), dt)
    assert not envelope.descent_is_over
    envelope.trip(StopReason.MODEL_LOST)
    for _ in range(ticks - 1):
        envelope.limit(STILL, STILL, STILL)
    assert not envelope.descent_is_over
    envelope.limit(STILL, STILL, STILL)
    assert envelope.descent_is_over


def test_after_several_faults_the_first_reason_stays_and_all_distrust_lasts_until_a_reset():
    envelope = settled()
    envelope.trip(StopReason.TORQUE_WRONG, without_model=True)
    envelope.trip(StopReason.ENCODER_DEAD, isolate=(1,))
    envelope.trip(StopReason.ENCODER_JUMPED, isolate=(3,))
    assert envelope.stop is StopReason.TORQUE_WRONG
    assert envelope.without_model
    assert envelope.isolated == {1, 3}
    np.testing.assert_array_equal(envelope.drive_damping, [0.0, 10.0, 0.0, 4.0])
    envelope.reset()
    assert not envelope.without_model
    assert not envelope.isolated
    assert not envelope.drive_damping.any()


def test_a_joint_whose_motor_is_not_trusted_gets_no_torque_and_its_drive_brakes_twice_as_hard():
    envelope = settled()
    envelope.trip(StopReason.TORQUE_WRONG, isolate=(2,), powerless=(1,))
    assert envelope.isolated == {1, 2}
    assert envelope.powerless == {1}
    np.testing.assert_array_equal(envelope.drive_damping, [0.0, 2.0 * 10.0, 4.0, 0.0])
    out = held(envelope, TORQUE, STILL, 100)
    assert out[1] == 0.0
    assert (out[[0, 2, 3]] != 0.0).all()


def test_the_sentence_of_a_stop_is_its_value_and_has_translations():
    for reason in StopReason:
        assert reason.sentence == reason.value
        assert reason.sentence.code == f"stop.{reason.name.lower()}"


def test_the_damping_array_shared_by_all_ticks_is_read_only():
    damping = Envelope(LIMITS, DT).drive_damping
    with pytest.raises(ValueError, match="read-only"):
        damping[0] = 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_machine_that_reports_no_torque_begins_at_zero(bad: float):
    envelope = Envelope(LIMITS, DT)
    envelope.begin(np.array([20.0, bad, -70.0, 8.0]))
    out = envelope.limit(np.array([20.0, 0.0, 3.0, 8.0]), STILL, STILL)
    np.testing.assert_allclose(out, [20.0, 0.0, -30.0 + RATE, 8.0])
    envelope.begin(np.full(4, bad))
    envelope.trip(StopReason.STOP_PRESSED)
    np.testing.assert_array_equal(envelope.limit(TORQUE, STILL, STILL), STILL)


def test_a_fault_at_the_first_tick_fades_the_torque_that_the_machine_gave():
    envelope = Envelope(LIMITS, DT)
    envelope.begin(TORQUE)
    envelope.limit(np.full(4, np.nan), STILL, STILL)
    half_way = [envelope.limit(STILL, STILL, STILL) for _ in range(1500)][-1]
    np.testing.assert_allclose(half_way, 0.5 * TORQUE, rtol=0.01)
