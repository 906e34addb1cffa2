"""Handover of an open controller from the Python driver to C, and back when the loop has ended."""

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import UdpBus
from exograv.rig.drives.udp.host import LOST_S, STALE_S, UdpRig
from exograv.signals import JointState

from .record import COUNTS, UdpAsked, UdpDrives


def handed_over(rig: UdpRig) -> UdpDrives:
    """Return the record of an open machine. The Python driver must not be used until `take_back`."""
    drives, link, units, clock, state = rig._drives, rig._link, rig._units, rig._clock, rig._state
    drives.table(UdpBus)
    opened = link._socket
    record = UdpDrives(
        socket=-1 if opened is None else opened.fileno(),
        joints=len(rig.joints),
        tick=clock.ticks,
        answer_ns=round(1e9 * rig._answer_s),
        began_s=clock._began,
        lost_s=LOST_S,
        stale_s=STALE_S,
        watchdog_s=drives.watchdog_s,
        session=link._session,
        grant=link._grant,
        sequence=link._sequence,
        heard=link._heard,
        taken=rig._taken,
        heard_at=rig._heard_at,
        is_on=rig._is_on,
        has_motor=units._of_motor_count is not None,
        state_t=state.t,
        state_sequence=state.sequence,
        has_q_motor=state.q_motor is not None,
        faulty=sum(1 << joint for joint in state.faulty),
        limited=units.limited,
        expired=rig._expired,
        incomplete=rig._incomplete,
    )
    for k in range(len(link._polls)):
        tick, sequence, t = link._states[k]
        record.polls[k], record.states[k] = UdpAsked(*link._polls[k]), UdpAsked(sequence, tick, t)
    for k, reason in enumerate(COUNTS):
        record.counts[k] = link.counts[reason]
    _hand_over_joints(rig, record)
    return record


def take_back(rig: UdpRig, record: UdpDrives) -> None:
    """Continue with the Python driver where C has ended: session, newest reports and counts."""
    link, n = rig._link, len(rig.joints)
    rig._clock.ticks, link._sequence, link._heard = record.tick, record.sequence, record.heard
    rig._taken, rig._heard_at, rig._is_on = record.taken, record.heard_at, bool(record.is_on)
    link._polls = [(one.sequence, one.tick, one.t) for one in record.polls]
    link._states = [(one.tick, one.sequence, one.t) for one in record.states]
    for k, reason in enumerate(COUNTS):
        link.counts[reason] = record.counts[k]
    rig._units.limited, rig._expired, rig._incomplete = record.limited, record.expired, record.incomplete
    for node, joint in zip(rig._nodes, record.each, strict=False):
        node.position, node.motor_position, node.current = joint.position, joint.motor_position, joint.current
        node.temperature_C, node.code, node.is_wanted = joint.temperature, joint.code, bool(joint.is_wanted)
        node.fault = DriveFault(joint.fault)
        node.sample, node.sampled_at = joint.sample, joint.sampled_at
    before = rig._state
    faulty = tuple(j for j in range(n) if record.faulty >> j & 1)
    fields = [rig._none + 0.0 for _ in range(3)]
    for values, of_joints in zip(fields, (record.q, record.joint_current, record.q_motor), strict=True):
        values[:] = of_joints[:n]
    q, current, q_motor = fields
    rig._state = JointState(
        record.state_t, record.state_sequence, q, current, before.tau, before.torque_source,
        q_motor if record.has_q_motor else None, faulty,
    )  # fmt: skip


def _hand_over_joints(rig: UdpRig, record: UdpDrives) -> None:
    units, state = rig._units, rig._state
    of_motor = units._of_motor_count
    for j, node in enumerate(rig._nodes):
        record.sign[j], record.offset[j], record.of_count[j] = units._sign[j], units._offset[j], units._of_count[j]
        record.of_motor_count[j] = 0.0 if of_motor is None else of_motor[j]
        record.current_max[j] = units._current_max[j]
        joint = record.each[j]
        joint.position, joint.motor_position, joint.current = node.position, node.motor_position, node.current
        joint.temperature, joint.code, joint.is_wanted = node.temperature_C, node.code, node.is_wanted
        joint.fault = int(node.fault)
        joint.counts_samples, joint.sample, joint.sampled_at = node.counts_samples, node.sample, node.sampled_at
        record.q[j], record.joint_current[j] = state.q[j], state.current[j]
        record.q_motor[j] = 0.0 if state.q_motor is None else state.q_motor[j]
