"""Buses whose drives the loop in C can read and write."""

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

from exograv.rig import Rig
from exograv.rig.drives.canopen.native import handover as canopen
from exograv.rig.drives.canopen.native.record import CanDrives
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.udp.host import UdpRig
from exograv.rig.drives.udp.native import handover as udp
from exograv.rig.drives.udp.native.record import UdpDrives


class NativeBus(NamedTuple):
    """Driver of a bus in C."""

    prefix: str
    """Prefix of its functions in the compiled loop: `…_read`, `…_write`."""
    record: type[ctypes.Structure]
    handed_over: Callable[[Any], Any]
    """Function that returns the record of an open machine."""
    take_back: Callable[[Any, Any], None]
    """Function that lets the Python driver continue where C has ended."""


UDP = NativeBus("udp", UdpDrives, udp.handed_over, udp.take_back)
CANOPEN = NativeBus("can", CanDrives, canopen.handed_over, canopen.take_back)


def native_bus(rig: Rig) -> NativeBus | None:
    """Return the driver in C for a machine; None if there is none, and for drives that wait for this computer."""
    if isinstance(rig, UdpRig) and not rig.is_in_lock_step:
        return UDP
    if isinstance(rig, CanopenRig) and not rig.is_in_lock_step and canopen.runs_in_c(rig):
        return CANOPEN
    return None
