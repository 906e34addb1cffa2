"""What a moteus says of itself, and what that is on any bus. Source: mjbots moteus, docs/protocol/registers.md."""

from moteus import Mode

from exograv.rig.drives.status import DriveFault

POWERLESS = frozenset({Mode.STOPPED, Mode.FAULT, Mode.TIMEOUT, Mode.BRAKE})
"""In which no current is driven; it lets go in the first two."""

FAULTS = {
    32: DriveFault.ENCODER,
    35: DriveFault.ENCODER,
    38: DriveFault.TEMPERATURE,
    40: DriveFault.STOP_LINE,  # no voltage for its motor: what a hardware stop takes away
    42: DriveFault.ENCODER,
    43: DriveFault.ENCODER,
}
"""By the maker's code; every other is an internal one."""


def fault_of(mode: int, code: int) -> DriveFault:
    """In this mode, with this code."""
    if mode == Mode.TIMEOUT:
        return DriveFault.WATCHDOG
    if mode == Mode.FAULT:
        return FAULTS.get(code, DriveFault.INTERNAL)
    return DriveFault.NONE
