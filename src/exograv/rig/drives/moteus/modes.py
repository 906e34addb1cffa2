"""What a moteus says of itself, and what that is on any bus. Source: mjbots moteus, docs/protocol/registers.md."""

from moteus import Mode

from exograv.rig.drive_status import DriveFault

from .frames import MoteusAnswer

POWERLESS = frozenset({Mode.STOPPED, Mode.FAULT, Mode.TIMEOUT, Mode.BRAKE})
"""In which no current is driven; it lets go in the first two."""

FAULTS = {
    32: DriveFault.ENCODER,
    35: DriveFault.ENCODER,
    38: DriveFault.TEMPERATURE,
    40: DriveFault.STOP_LINE,  # no supply
    42: DriveFault.ENCODER,
    43: DriveFault.ENCODER,
}
"""By the maker's code; every other is an internal one."""


SUPPLY_V = 8.0
"""Below it a hardware stop has taken the supply: no moteus is made for less than 10."""


def fault_of(said: MoteusAnswer) -> DriveFault:
    """What is wrong by its own account."""
    fault = DriveFault.STOP_LINE if said.supply_V < SUPPLY_V else DriveFault.NONE
    if said.mode == Mode.TIMEOUT:
        return fault | DriveFault.WATCHDOG
    if said.mode == Mode.FAULT:
        return fault | FAULTS.get(said.code, DriveFault.INTERNAL)
    return fault
