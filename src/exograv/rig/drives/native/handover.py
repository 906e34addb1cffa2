"""Handover of what all buses share: clock, units, measurement and counts of an open machine."""

from typing import Any

from exograv.rig.drives.driver import Driver
from exograv.signals import JointState

from .record import DriveMachine


def hand_over_machine(rig: Driver[Any], record: DriveMachine) -> None:
    """Write the shared part of a bus's record; its socket belongs to the bus."""
    units, clock, state = rig._units, rig._clock, rig._state
    record.joints, record.tick, record.began_s = len(rig.joints), clock.ticks, clock._began
    record.answer_ns, record.is_on = round(1e9 * rig._answer_s), rig._is_on
    of_motor = units._of_motor_count
    record.has_motor = of_motor is not None
    record.state_t, record.state_sequence, record.has_q_motor = state.t, state.sequence, state.q_motor is not None
    record.faulty = sum(1 << joint for joint in state.faulty)
    record.limited, record.expired, record.incomplete = units.limited, rig._expired, rig._incomplete
    for j in range(len(rig.joints)):
        record.sign[j], record.offset[j], record.of_count[j] = units._sign[j], units._offset[j], units._of_count[j]
        record.of_motor_count[j] = 0.0 if of_motor is None else of_motor[j]
        record.current_max[j] = units._current_max[j]
        record.q[j], record.joint_current[j] = state.q[j], state.current[j]
        record.q_motor[j] = 0.0 if state.q_motor is None else state.q_motor[j]


def take_back_machine(rig: Driver[Any], record: DriveMachine) -> None:
    """Continue with clock, counts and newest measurement where C has ended."""
    n, before = len(rig.joints), rig._state
    rig._clock.ticks, rig._is_on = record.tick, bool(record.is_on)
    rig._units.limited, rig._expired, rig._incomplete = record.limited, record.expired, record.incomplete
    fields = [rig._none + 0.0 for _ in range(3)]
    for values, of_joints in zip(fields, (record.q, record.joint_current, record.q_motor), strict=True):
        values[:] = of_joints[:n]
    q, current, q_motor = fields
    rig._state = JointState(
        record.state_t, record.state_sequence, q, current, before.tau, before.torque_source,
        q_motor if record.has_q_motor else None, tuple(j for j in range(n) if record.faulty >> j & 1),
    )  # fmt: skip
