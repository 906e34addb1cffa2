"""Fault table for flights through a driver: faults that simulated drives produce, and those that only drives have."""

from collections.abc import Mapping
from types import MappingProxyType

from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

from . import drive_faults as of_drives
from . import lying_faults as of_lies
from .fault_table import FAULTS, Fault
from .injector import Injector

BUSES = ("udp", "canopen")

LOST_MS = 10.0
"""Longest allowed time to detect a lost drive [ms].

It is half of the drive's own watchdog time. The other drives must begin the descent before the lost one brakes.
"""

_LOST = (StopReason.DRIVE_FAULT,)
_ONLY = (
    Fault("F12 lost", of_drives.Unplugged, _LOST, LOST_MS, SafeState.ISOLATION),
    Fault("F12 replug", of_drives.DriveReconnection, _LOST, LOST_MS, SafeState.ISOLATION),
    Fault("F12 hot", of_drives.Overheated, _LOST, FAULTS["F12"].budget_ms, SafeState.ISOLATION),
)
ONLY_DRIVES: Mapping[str, Fault] = MappingProxyType({fault.id: fault for fault in _ONLY})
"""Faults by identifier that need drives on a bus; the twin alone does not have them."""

ALL: Mapping[str, Fault] = MappingProxyType({**FAULTS, **ONLY_DRIVES})

AT_DRIVES: Mapping[str, type[Injector]] = MappingProxyType(
    {
        "F09": of_drives.DriveTorqueConstant,
        "F12": of_drives.InternalFault,
        "F13": of_drives.CableOut,
        "F39": of_drives.DriveStopLineOpen,
        "F46": of_lies.DriveTorqueConstantDrift,
        **{name: fault.injector for name, fault in ONLY_DRIVES.items()},
    }
)
"""Injectors by identifier that act at the drives, in place of those that act on the twin."""

IN_PERSON = ("F28", "F29", "F49", "F50", "F51")
"""Faults that act on the person in the simulated machine. On hardware, a person has to produce them."""

IN_WORLD = ("F45",)
"""Faults that act on the base of the machine."""


def injector_of(name: str, bus: str | None) -> type[Injector]:
    """Return the injector of a fault, on the twin itself (None) or through the driver of a bus."""
    return ALL[name].injector if bus is None else AT_DRIVES.get(name, ALL[name].injector)


def injected_by(name: str) -> str:
    """Return the place of injection in a flight through a driver, as one word for tables."""
    if name in AT_DRIVES:
        return "drive"
    if name in IN_PERSON:
        return "person"
    if name in IN_WORLD:
        return "world"
    injector = ALL[name].injector
    if injector.measured is not Injector.measured or injector.commanded is not Injector.commanded:
        return "interface"
    return "guard" if injector.ends_guard or name == "F30" else "control"
