"""Times of the guard are milliseconds: on a bus of 2 or 4 ms a fault is found within the budget that it has at 1 ms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, Guard, SafeState
from exograv.safety.limits import Limits
from exograv.safety.period import ticks_of
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

LIMITS = Limits(np.array([60.0, 30.0]), np.array([10.0, 4.0]))
GAIN = [1.0, 1.0]
TORQUE, SPEED = np.array([10.0, -3.0]), np.array([0.6, 0.6])
PERIODS_MS = (1, 2, 4)
ONSET_MS = 400


def found_ms(period_ms: int, fault: str, most_ms: int = 400) -> tuple[float, StopReason | None]:
    """Return the time after which the guard lets the arm down, and the reason."""
    dt = 1e-3 * period_ms
    envelope = Envelope(LIMITS, dt)
    envelope.begin(TORQUE)
    guard = Guard.of_machine(envelope, dt, GAIN)
    onset = ONSET_MS // period_ms
    for k in range(onset + most_ms // period_ms):
        now, moved = k * dt, np.array([0.3, 0.6]) + SPEED * dt * k
        is_on, q, current = k >= onset, moved.copy(), TORQUE.copy()
        if is_on and fault == "stuck":
            q[0] = 0.3 + SPEED[0] * dt * onset
        if is_on and fault == "parts":
            q[0] = 0.3 + SPEED[0] * dt * (2 * onset - k)
        if is_on and fault == "torque":
            current[1] += 8.0
        if is_on and fault == "nan":
            q[1] = math.nan
        state = JointState(now, k, q, current, np.full(2, math.nan), TorqueSource.CURRENT, moved)
        if is_on and fault == "now and then" and (k - onset) % (152 // period_ms) == 0:
            state = state._replace(sequence=k - 1)
        answers = ControlRequest(k, now + COMMAND_LIFE_S, TORQUE)
        out = guard.step(
            None if is_on and fault == "silent" else state, None if is_on and fault == "dead" else answers, now
        )
        if out.safe_state > SafeState.BRIDGE:
            return period_ms * (k - onset), envelope.stop
    return math.inf, None


BUDGETS_MS = {
    "stuck": (30.0, (StopReason.ENCODER_DEAD, StopReason.ENCODERS_PART)),
    "parts": (20.0, (StopReason.ENCODERS_PART,)),
    "torque": (26.0, (StopReason.TORQUE_WRONG,)),
    "nan": (4.0, (StopReason.NO_MEASUREMENT,)),
    "silent": (6.0, (StopReason.MACHINE_SILENT,)),
    "dead": (5.0, (StopReason.CONTROL_SILENT,)),
}
"""Budget in milliseconds and reasons for F02, F07, F11, F01, F04, F16 of docs/explanation/safety.md."""


@pytest.mark.parametrize("period_ms", PERIODS_MS)
@pytest.mark.parametrize("fault", BUDGETS_MS)
def test_a_fault_is_found_within_its_budget_at_every_period(fault: str, period_ms: int):
    budget, reasons = BUDGETS_MS[fault]
    found, reason = found_ms(period_ms, fault)
    assert found <= budget
    assert reason in reasons


@pytest.mark.parametrize("period_ms", PERIODS_MS)
def test_a_machine_without_faults_is_never_stopped(period_ms: int):
    assert found_ms(period_ms, "none") == (math.inf, None)


@pytest.mark.parametrize("period_ms", PERIODS_MS)
def test_occasional_missed_measurements_are_tolerated_at_every_period(period_ms: int):
    assert found_ms(period_ms, "now and then", 1500) == (math.inf, None)


@pytest.mark.parametrize("period_ms", PERIODS_MS)
def test_misses_are_bridged_at_every_period_and_never_longer_than_the_life_of_a_command(period_ms: int):
    assert 0.0 < found_ms(period_ms, "dead")[0] <= 1e3 * COMMAND_LIFE_S


@given(ms=st.integers(1, 2000), period_ms=st.sampled_from(PERIODS_MS))
def test_ticks_are_as_long_as_the_time_or_just_longer(ms: int, period_ms: int):
    ticks = ticks_of(ms, 1e-3 * period_ms)
    assert ms <= ticks * period_ms < ms + period_ms


def test_a_period_that_is_too_short_by_a_rounding_error_adds_no_tick():
    assert ticks_of(10, 1e-3 * (1.0 - 3e-8)) == 10
    assert ticks_of(10, 1e-3 * (1.0 - 3e-7)) == 11
