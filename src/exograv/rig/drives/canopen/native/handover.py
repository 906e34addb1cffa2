"""Handover of open CANopen drives from the Python driver to C, and back when the loop has ended."""

import ipaddress
from typing import Any

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.canopen.bus import ECHOING
from exograv.rig.drives.canopen.node import CanopenNode, OwedAnswers
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.native.handover import hand_over_machine, take_back_machine

from .record import COUNTS, STATES, CanDrives, CanNode, CanOwed, Link

SOCKETCAN = "socketcan"


def runs_in_c(rig: CanopenRig) -> bool:
    """Return True if C can use the adapter: SocketCAN, or multicast by IPv4."""
    settings = rig._settings
    if settings.interface not in ECHOING:
        return settings.interface == SOCKETCAN
    try:
        ipaddress.IPv4Address(settings.channel.partition(":")[0])
    except ipaddress.AddressValueError:  # IPv6, or a name
        return False
    return True


def handed_over(rig: CanopenRig) -> CanDrives:
    """Return the record of an open machine. The Python driver must not be used until `take_back`."""
    bus, cycle = rig._link, rig._frames
    assert bus is not None
    adapter: Any = bus.adapter  # each adapter of python-can has its own attributes
    record = CanDrives(told=cycle._told, beat_every=cycle._beat_every)
    hand_over_machine(rig, record.machine)
    if bus._mark is None:
        record.link, record.socket = Link.SOCKETCAN, adapter.socket.fileno()
    else:
        group, port = adapter._multicast._send_destination
        record.link, record.socket = Link.MULTICAST, adapter._multicast.fileno()
        record.group, record.port = int(ipaddress.ip_address(group)), port
        record.mark[:] = bus._mark.encode()
    for k, reason in enumerate(COUNTS):
        record.counts[k] = bus.counts[reason]
    for node, into in zip(rig._nodes, record.each, strict=False):
        _hand_over_node(node, into)
    return record


def take_back(rig: CanopenRig, record: CanDrives) -> None:
    """Continue with the Python driver where C has ended: newest reports and counts."""
    bus, cycle = rig._link, rig._frames
    assert bus is not None
    cycle._told = record.told
    for k, reason in enumerate(COUNTS):
        bus.counts[reason] = record.counts[k]
    for node, of_node in zip(rig._nodes, record.each, strict=False):
        _take_back_node(node, of_node)
    take_back_machine(rig, record.machine)


def _hand_over_node(node: CanopenNode, into: CanNode) -> None:
    into.node, into.lost_after, into.misses = node.drive.node, node._lost_after, node._misses
    into.has_answered, into.is_wanted = node.has_answered, node.is_wanted
    into.fault, into.code, into.own_fault = int(node.fault), node.code, int(node.own_fault)
    into.position, into.motor_position, into.current = node.position, node.motor_position, node.current
    into.temperature, into.amperes = node.temperature_C, node._amperes
    into.state, into.control, into.has_damping = STATES.index(node.state), node.control, node.has_damping
    for owed, of_node in ((node._measured, into.measured), (node._motor, into.motor)):
        of_node.missing, of_node.came_late = owed.missing, owed._came_late


def _take_back_node(node: CanopenNode, of_node: CanNode) -> None:
    node._misses, node.has_answered, node.is_wanted = (
        of_node.misses,
        bool(of_node.has_answered),
        bool(of_node.is_wanted),
    )
    node.fault, node.code, node.own_fault = DriveFault(of_node.fault), of_node.code, DriveFault(of_node.own_fault)
    node.position, node.motor_position, node.current = of_node.position, of_node.motor_position, of_node.current
    node.temperature_C, node.state, node.control = of_node.temperature, STATES[of_node.state], of_node.control
    _take_back_owed(node._measured, of_node.measured)
    _take_back_owed(node._motor, of_node.motor)


def _take_back_owed(owed: OwedAnswers, of_node: CanOwed) -> None:
    owed.missing, owed._came_late = of_node.missing, bool(of_node.came_late)
