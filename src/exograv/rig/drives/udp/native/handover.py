"""Handover of an open controller from the Python driver to C, and back when the loop has ended."""

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.native.handover import hand_over_machine, take_back_machine
from exograv.rig.drives.udp.host import LOST_S, STALE_S, UdpRig

from .record import COUNTS, UdpAsked, UdpDrives


def handed_over(rig: UdpRig) -> UdpDrives:
    """Return the record of an open machine. The Python driver must not be used until `take_back`."""
    link = rig._link
    opened = link._socket
    record = UdpDrives(
        socket=-1 if opened is None else opened.fileno(),
        lost_s=LOST_S,
        stale_s=STALE_S,
        watchdog_s=rig._drives.watchdog_s,
        session=link._session,
        grant=link._grant,
        sequence=link._sequence,
        heard=link._heard,
        taken=rig._taken,
        heard_at=rig._heard_at,
    )
    hand_over_machine(rig, record.machine)
    for k in range(len(link._polls)):
        tick, sequence, t = link._states[k]
        record.polls[k], record.states[k] = UdpAsked(*link._polls[k]), UdpAsked(sequence, tick, t)
    for k, reason in enumerate(COUNTS):
        record.counts[k] = link.counts[reason]
    for node, joint in zip(rig._nodes, record.each, strict=False):
        joint.position, joint.motor_position, joint.current = node.position, node.motor_position, node.current
        joint.temperature, joint.code, joint.is_wanted = node.temperature_C, node.code, node.is_wanted
        joint.fault = int(node.fault)
        joint.counts_samples, joint.sample, joint.sampled_at = node.counts_samples, node.sample, node.sampled_at
    return record


def take_back(rig: UdpRig, record: UdpDrives) -> None:
    """Continue with the Python driver where C has ended: session, newest reports and counts."""
    link = rig._link
    link._sequence, link._heard = record.sequence, record.heard
    rig._taken, rig._heard_at = record.taken, record.heard_at
    link._polls = [(one.sequence, one.tick, one.t) for one in record.polls]
    link._states = [(one.tick, one.sequence, one.t) for one in record.states]
    for k, reason in enumerate(COUNTS):
        link.counts[reason] = record.counts[k]
    for node, joint in zip(rig._nodes, record.each, strict=False):
        node.position, node.motor_position, node.current = joint.position, joint.motor_position, joint.current
        node.temperature_C, node.code, node.is_wanted = joint.temperature, joint.code, bool(joint.is_wanted)
        node.fault = DriveFault(joint.fault)
        node.sample, node.sampled_at = joint.sample, joint.sampled_at
    take_back_machine(rig, record.machine)
