"""The order of a machine's joints is a matter of names: another order gives the same decisions in that order."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

JOINTS, TICKS, BEGINS, PERIOD_S = 5, 420, 150, 1e-3
MOST_FACTORS = 2

EVENTS = {
    "none": None,
    "stuck": StopReason.ENCODERS_PART,
    "stuck while moving": StopReason.ENCODER_DEAD,
    "slips": StopReason.ENCODERS_PART,
    "jumps": StopReason.ENCODER_JUMPED,
    "image frozen": StopReason.ENCODER_DEAD,
    "motor opposite": StopReason.ENCODERS_PART,
    "current off": StopReason.TORQUE_WRONG,
    "current biased": StopReason.TORQUE_WRONG,
    "drive fault": StopReason.DRIVE_FAULT,
    "not finite": StopReason.NO_MEASUREMENT,
    "asked too much": None,
    "runs away": StopReason.TOO_FAST,
}
"""Event at one joint, and the stop that it causes."""

FROZEN = {"stuck": ("q",), "stuck while moving": ("q",), "image frozen": ("q", "q_motor")}
"""Signals of the joint that keep their value."""

CHANGES: dict[str, dict[str, Callable[[np.ndarray], np.ndarray | float]]] = {
    "slips": {"q": lambda k: 1e-3 * k},
    "jumps": {"q": lambda _: 0.5},
    "motor opposite": {"q": lambda k: 8e-4 * k, "q_motor": lambda k: -8e-4 * k},
    "current off": {"off": lambda _: 6.0},
    "current biased": {"off": lambda _: 2.7},
    "not finite": {"q": lambda k: np.where(k < 60, np.nan, 0.0)},
    "asked too much": {"asked": lambda _: 80.0},
    "runs away": {"q": lambda k: 2e-5 * k**2, "q_motor": lambda k: 2e-5 * k**2},
}
"""Sum added to signals of the joint, by the number of ticks since the event."""

FIELDS = range(core.TORQUE_MAX, core.TORQUE_MAX + 72 * core.JOINTS, core.JOINTS)
RINGS = range(core.USED, core.SIZE, core.JOINTS)


class Course:
    """Signals of all joints, the same for each order of them."""

    def __init__(self, event: str, joint: int, seed: int):
        rng, t = np.random.default_rng([seed, list(EVENTS).index(event)]), PERIOD_S * np.arange(TICKS)[:, None]
        speed = rng.uniform(0.1, 0.6, JOINTS)
        self.q = 0.2 * np.sin(2.0 * np.pi * speed * t + rng.uniform(0.0, 6.0, JOINTS))
        self.q_motor = self.q - rng.normal(0.0, 0.1, JOINTS) + rng.normal(0.0, 1e-5, self.q.shape)
        self.q += rng.normal(0.0, 1e-5, self.q.shape)
        self.off = rng.normal(0.0, 0.02, self.q.shape)
        self.asked = rng.normal(0.0, 0.3, JOINTS) + 0.5 * np.sin(3.0 * t + np.arange(JOINTS))
        self.faulty = frozenset[int]()
        self.event, self.joint = event, joint
        self._happen()

    def _happen(self) -> None:
        j, since = self.joint, np.arange(TICKS - BEGINS)
        if self.event == "stuck while moving":
            for signal in (self.q, self.q_motor):
                signal[:, j] += 1.5 * PERIOD_S * np.arange(TICKS)
        for name in FROZEN.get(self.event, ()):
            getattr(self, name)[BEGINS:, j] = getattr(self, name)[BEGINS, j]
        for name, change in CHANGES.get(self.event, {}).items():
            getattr(self, name)[BEGINS:, j] += change(since)
        if self.event == "drive fault":
            self.faulty = frozenset({j})


def guard_of(order: list[int]) -> Guard:
    """Guard of a worn machine whose joints are in this order."""
    rng = np.random.default_rng(0)
    exo, arm = rng.normal(size=(2, JOINTS, Features(JOINTS, MOST_FACTORS).count))
    each = {name: rng.uniform(low, high, JOINTS)[order] for name, low, high in (
        ("torque", 8.0, 30.0), ("damping", 1.0, 4.0), ("active", 4.0, 9.0), ("dry", 0.1, 0.4), ("error", 0.1, 0.3),
        ("gain", 0.8, 1.5),
    )}  # fmt: skip
    # The limb lists its joints from the shoulder on, wherever they stand in the machine's arrays.
    chain = tuple(order.index(j) for j in range(JOINTS))
    table = PlausibleTable((LimbTable(chain, MOST_FACTORS, exo, arm),), each["dry"], 0.1 * each["dry"], each["error"])
    envelope = Envelope(Limits(each["torque"], each["damping"]), PERIOD_S, library=None)
    envelope.person = GuardedPerson(
        PersonLimits(table, each["active"], np.full(JOINTS, -2.5), np.full(JOINTS, 2.5)), 0.0
    )
    return Guard.of_machine(envelope, PERIOD_S, each["gain"].tolist())


def fly(course: Course, order: list[int]) -> tuple[np.ndarray, np.ndarray, StopReason | None]:
    """Return all joint fields and rings after some ticks, in the order 0, 1, …; the rest of the record; the stop."""
    guard, back = guard_of(order), np.argsort(order)
    record, gain = guard.envelope.record, guard.envelope.record.of(core.GAIN)
    fields, rest, before = list[np.ndarray](), list[np.ndarray](), np.zeros(JOINTS)
    for k in range(TICKS):
        t = k * PERIOD_S
        tau = record.tau.copy()
        current = (tau + course.off[k][order]) / gain
        if course.event == "image frozen" and k > BEGINS:
            kept = order.index(course.joint)
            current[kept] = before[kept]
        before = current
        state = JointState(
            t, k, course.q[k][order], current, np.full(JOINTS, np.nan), TorqueSource.CURRENT, course.q_motor[k][order]
        )
        if course.faulty and k >= BEGINS:
            state = state._replace(faulty=tuple(order.index(j) for j in course.faulty))
        guard.see(state, t)
        guard.decide(ControlRequest(k, t + 0.005, course.asked[k][order]), t)
        if k % 20 == 0 or k == TICKS - 1:
            fields.append(np.array([record.view[start : start + JOINTS][back] for start in (*FIELDS, *RINGS)]))
            rest.append(record.view[: core.TORQUE_MAX].copy())
    return np.array(fields), np.array(rest), guard.envelope.stop


@pytest.mark.parametrize("event", EVENTS)
def test_another_order_of_the_joints_changes_no_number_but_its_place(event: str):
    joint = 1 + list(EVENTS).index(event) % (JOINTS - 1)
    course = Course(event, joint, seed=1)
    others = [j for j in (3, 1, 4, 0, 2) if j != joint]
    fields, rest, stop = fly(course, list(range(JOINTS)))
    turned_fields, turned_rest, turned_stop = fly(course, [joint, *others])
    assert turned_stop == stop == EVENTS[event]
    np.testing.assert_allclose(turned_fields, fields, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(turned_rest, rest, rtol=1e-9, atol=1e-9)
