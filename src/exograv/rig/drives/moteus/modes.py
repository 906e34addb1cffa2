"""Modes and faults of a moteus, as faults of any bus. Source: mjbots moteus, docs/protocol/registers.md."""

from moteus import Mode

from exograv.rig.drive_status import DriveFault

from .frames import MoteusAnswer

POWERLESS = frozenset({Mode.STOPPED, Mode.FAULT, Mode.TIMEOUT, Mode.BRAKE})
"""Modes without a driven current; in the first two the drive lets go."""

FAULTS = {
    32: DriveFault.ENCODER,
    35: DriveFault.ENCODER,
    38: DriveFault.TEMPERATURE,
    40: DriveFault.STOP_LINE,  # no supply
    42: DriveFault.ENCODER,
    43: DriveFault.ENCODER,
}
"""Faults by the maker's code; every other code is an internal fault."""


SUPPLY_V = 8.0
"""Supply below which a hardware stop has cut it off [V]: no moteus is made for less than 10 V."""


def fault_of(said: MoteusAnswer) -> DriveFault:
    """Return the fault that an answer reports."""
    fault = DriveFault.STOP_LINE if said.supply_V < SUPPLY_V else DriveFault.NONE
    if said.mode == Mode.TIMEOUT:
        return fault | DriveFault.WATCHDOG
    if said.mode == Mode.FAULT:
        return fault | FAULTS.get(said.code, DriveFault.INTERNAL)
    return fault
