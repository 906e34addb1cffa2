"""The scalar functions of the guard keep their claims at the values where a rule begins or ends."""

import math

import numpy as np
import pytest

from exograv.safety.limits import PersonLimits
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
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
