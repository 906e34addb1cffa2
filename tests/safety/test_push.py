"""A level above Earth pushes the arm down with consent only, and the push ends where it may not go on."""

import numpy as np
import pytest

from exograv.safety.guard import CONSENT_S, GRAVITY_LEVEL_S
from exograv.safety.limits import PersonLimits
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.state import put_state, state_places

from .test_guard import DT, LIMITS, ROUNDING, Bench, worn

MACHINE_NM, ARM_NM = np.array([5.0, 1.0]), np.array([10.0, 4.0])
"""Torque that carries the machine, and the arm, of `pushed`."""
REACHED: dict[tuple[float, float], tuple[int, np.ndarray]] = {}
"""Tick and state of the guard of `pushed`, for each level and consent: the ramp takes thousands of ticks."""


def pushed(level: float = 1.8, consent_s: float = CONSENT_S) -> tuple[Bench, GuardedPerson]:
    """Return a bench that has reached a level above 1 with the wearer's consent, and gives the torque for it."""
    bench = Bench()
    carries = [np.hstack([torque[:, None], np.zeros((2, 8))]) for torque in (MACHINE_NM, ARM_NM)]
    table = PlausibleTable((LimbTable((0, 1), 2, carries[0], carries[1]),), np.zeros(2), np.zeros(2), np.zeros(2))
    limits = PersonLimits(table, np.full(2, 4.0), np.full(2, -3.0), np.full(2, 3.0))
    person = bench.guard.envelope.person = GuardedPerson(limits, 1.0)
    record = bench.guard.envelope.record
    if (level, consent_s) not in REACHED:
        bench.tick(MACHINE_NM)
        assert bench.guard.consent(consent_s)
        assert bench.guard.feel(level)
        for _ in range(round(GRAVITY_LEVEL_S * (level - 1.0) / DT) + 2):
            bench.tick(carrying(person))
        assert person.gravity_level == level
        REACHED[level, consent_s] = bench.k, record.view[state_places(record)].copy()
    bench.k, state = REACHED[level, consent_s]
    put_state(record, state)
    return bench, person


def carrying(person: GuardedPerson) -> np.ndarray:
    """Return the torque with which the arm feels the level in force."""
    return MACHINE_NM + (1.0 - person.gravity_level) * ARM_NM


def test_a_level_above_earth_needs_the_wearer_s_consent():
    bench, person = worn(1.0)
    assert bench.guard.feel(1.2) is False
    assert bench.guard.consent()
    assert bench.guard.feel(1.2)
    bench.settled(1500)
    assert person.gravity_level == 1.2


def test_nobody_gives_consent_outside_of_the_machine_in_a_stop_or_for_longer_than_allowed():
    bench, _ = worn(1.0)
    assert not Bench().guard.consent()
    assert not bench.guard.consent(CONSENT_S + 1.0)
    assert not bench.guard.consent(float("nan"))
    assert bench.guard.consent(-DT) is False
    bench.guard.press_stop()
    assert bench.guard.consent() is False


def test_a_consent_of_half_a_second_allows_a_push_and_runs_out_with_the_time():
    bench, _ = worn(1.0)
    assert bench.guard.consent_s == 0.0
    assert bench.guard.consent(0.5)
    assert bench.guard.feel(1.2)
    bench.settled(200)
    assert bench.guard.consent_s == pytest.approx(0.3)
    bench.settled(310)
    assert bench.guard.consent_s == 0.0
    assert not bench.guard.feel(1.2)


@pytest.mark.parametrize("ramp_s", [0.0, 1.5])
def test_a_consent_that_runs_out_on_the_way_up_ends_a_small_push_by_a_ramp_back_to_earth(ramp_s: float):
    bench, person = worn(1.0)
    assert bench.guard.consent(0.5)
    assert bench.guard.feel(1.2, ramp_s)
    felt = []
    for _ in range(1200):
        bench.tick()
        felt.append(person.gravity_level)
    assert max(felt) == pytest.approx(1.1 if ramp_s == 0.0 else 1.0 + 0.2 / 3.0, abs=0.001)
    assert felt[-1] == 1.0
    assert np.diff(felt[500:]).min() == pytest.approx(-DT / GRAVITY_LEVEL_S)


def test_a_small_push_ends_in_a_stop_too():
    bench, person = worn(1.0)
    assert bench.guard.consent()
    assert bench.guard.feel(1.2)
    bench.settled(1100)
    bench.guard.press_stop()
    bench.settled(130)
    assert person.gravity_level == 1.0


def test_in_a_wall_the_level_of_earth_may_be_lowered():
    bench, person = worn(1.0)
    bench.q = np.array([0.3, 2.95])
    bench.settled(50)
    assert person.is_in_a_wall
    assert bench.guard.feel(0.9)
    bench.settled(510)
    assert person.gravity_level == 0.9


def test_at_the_speed_from_which_on_the_guard_brakes_a_push_goes_on():
    bench, person = pushed()
    record = bench.guard.envelope.record
    for fastest, goes_on in ((LIMITS.v_damping_rad_s, True), (1.001 * LIMITS.v_damping_rad_s, False)):
        record.numbers[core.FASTEST] = fastest
        core.approach_level(record.numbers)
        assert (person.gravity_level == 1.8) == goes_on


def test_the_push_of_a_level_above_earth_goes_out():
    bench, person = pushed()
    np.testing.assert_allclose(bench.tick(carrying(person)).tau, MACHINE_NM - 0.8 * ARM_NM)


def test_a_level_above_earth_goes_back_by_a_ramp_when_the_consent_runs_out():
    bench, person = pushed(1.8, consent_s=5.0)
    felt = []
    for _ in range(6000):
        bench.tick(carrying(person))
        felt.append(person.gravity_level)
    assert felt[0] == 1.8
    assert felt[-1] == 1.0
    assert np.diff(felt).min() >= -DT / GRAVITY_LEVEL_S - ROUNDING


def test_a_withdrawn_consent_lets_no_level_above_earth_come_back():
    bench, person = pushed()
    assert bench.guard.consent(0.0)
    assert not bench.guard.feel(1.5)
    for _ in range(5000):
        bench.tick(carrying(person))
    assert person.gravity_level == 1.0


def move(bench: Bench, person: GuardedPerson, speed: float, seconds: float) -> None:
    """Move the second joint at this speed [rad/s]; a joint that rests trembles, since its encoder is not dead."""
    for k in range(round(seconds / DT)):
        bench.v = np.array([0.0, speed + (-0.02, 0.02)[k % 2]])
        bench.tick(carrying(person))


@pytest.mark.parametrize(
    "motion", [((2.0, 1.15), (0.0, 0.55)), ((-2.0, 1.3), (1.05 * LIMITS.v_damping_rad_s, 0.55))], ids=["wall", "fast"]
)
def test_the_push_ends_in_half_a_second_in_a_wall_and_at_a_fast_joint_and_comes_back_by_a_ramp(motion):
    bench, person = pushed()
    for speed, seconds in motion:
        move(bench, person, speed, seconds)
    assert person.gravity_level == pytest.approx(1.0, abs=DT / GRAVITY_LEVEL_S + ROUNDING)
    move(bench, person, -1.0, 1.0)
    move(bench, person, 0.0, 0.8 * GRAVITY_LEVEL_S + 0.1)
    assert bench.guard.envelope.stop is None
    assert person.gravity_level == 1.8


def test_a_stop_above_earth_ends_the_push_first_and_then_lets_the_machine_down():
    bench, person = pushed()
    bench.guard.press_stop()
    outs = np.array([bench.tick(carrying(person)).tau for _ in range(round(1e3 * LIMITS.descent_s) + 10)])
    after = round(0.5 / DT)
    share = 1.0 - 0.5 / LIMITS.descent_s
    np.testing.assert_allclose(outs[after], MACHINE_NM * share, atol=0.05)
    assert (np.diff(outs[:after], axis=0) > 0.0).all(), "the push fades"
    assert (outs[-1] == 0.0).all()
    assert person.gravity_level == 1.0


def test_a_stop_before_control_pushes_gives_no_push_upwards():
    bench, _person = pushed()
    for _ in range(200):
        bench.tick(MACHINE_NM)  # control carries the machine only
    bench.guard.press_stop()
    outs = np.array([bench.tick(MACHINE_NM).tau for _ in range(1000)])
    assert (outs <= MACHINE_NM + ROUNDING).all()
