"""The same faults through a driver: which of them the simulated drives have themselves, and which only drives have."""

from collections.abc import Mapping
from types import MappingProxyType

from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

from . import drive_faults as of_drives
from .fault_table import FAULTS, Fault
from .injector import Injector

BUSES = ("udp", "canopen")

LOST_MS = 10.0
"""In which a lost drive has to be found: half of its own watchdog, so that the others come down before it brakes."""

_LOST = (StopReason.DRIVE_FAULT,)
_ONLY = (
    Fault("F12 lost", of_drives.Unplugged, _LOST, LOST_MS, SafeState.ISOLATION),
    Fault("F12 replug", of_drives.DriveReconnection, _LOST, LOST_MS, SafeState.ISOLATION),
    Fault("F12 hot", of_drives.Overheated, _LOST, FAULTS["F12"].budget_ms, SafeState.ISOLATION),
)
ONLY_DRIVES: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _ONLY})
"""By identifier: of a bus with drives, which the twin alone has not."""

ALL: Mapping[str, Fault] = MappingProxyType({**FAULTS, **ONLY_DRIVES})

AT_DRIVES: Mapping[str, type[Injector]] = MappingProxyType(
    {
        "F09": of_drives.DriveTorqueConstant,
        "F12": of_drives.InternalFault,
        "F13": of_drives.CableOut,
        "F39": of_drives.DriveStopLineOpen,
        **{name: fault.injector for name, fault in ONLY_DRIVES.items()},
    }
)
"""What the drives have themselves in place of what the twin is told by the campaign."""

IN_PERSON = ("F28", "F29")
"""Done to the person in the simulated machine; on hardware somebody has to do it."""


def injector_of(name: str, bus: str | None) -> type[Injector]:
    """Of a fault, on the twin itself or through the driver of a bus."""
    return ALL[name].injector if bus is None else AT_DRIVES.get(name, ALL[name].injector)


def injected_by(name: str) -> str:
    """What a fault is done to when a driver stands between, in a word for tables."""
    if name in AT_DRIVES:
        return "drive"
    if name in IN_PERSON:
        return "person"
    injector = ALL[name].injector
    if injector.measured is not Injector.measured or injector.commanded is not Injector.commanded:
        return "interface"
    return "guard" if injector.ends_guard or name == "F30" else "control"
