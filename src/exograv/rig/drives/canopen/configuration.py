"""Check and set-up of each drive by SDO, before anything moves. The loop sends no SDO."""

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.settings import Drive, Drives

from . import objects as at
from .emergency import fault_of
from .network import SdoNode
from .node import CanopenNode
from .objects import CobId, Entry

ABORT_IS_FAULT, SLOW_DOWN_ON_RAMP, GO_ON_TELLING = 1, 2, 1
"""Settings of a drive's reactions.

A lost connection is a fault. A fault and a quick stop end the motion on the quick-stop ramp. TPDOs continue after an
error.
"""

RATED_TOLERANCE = 0.01
"""Largest relative difference between the rated currents of drive and file. Every torque would be wrong by it."""

WITH_EACH_SYNC, AT_ONCE = 1, 0xFF
"""Transmission types of PDOs.

A drive sends its measurement with each SYNC. It takes a command on arrival: with the next SYNC, the command would be a
period older.
"""

INVALID = 1 << 31
"""Bit of a PDO's number that marks the PDO as invalid while it is changed."""


def configure(drives: Drives, node: CanopenNode, asked: SdoNode) -> tuple[str, ...]:
    """Check one drive against `drives.toml` and set it up; the drive stays pre-operational.

    Returns:
        Sentences about functions that this drive lacks.

    Raises:
        RigError: The drive does not answer, lacks a required function, or rejects a setting.
        ConfigError: The drive differs from `drives.toml`.
    """
    drive = node.drive
    _check_identity(drive, asked)
    _check_nameplate(drive, asked)
    must(drive, asked, at.MODE, at.CYCLIC_TORQUE, "it has no cyclic synchronous torque mode")
    # The drive limits its torque at this value. The limit of the file is equal or smaller.
    most = round(1000.0 * drive.current_max_A / drive.current_rated_A)
    must(drive, asked, at.MAX_TORQUE, most, "its torque would not be limited")
    notes = _reactions(drives, drive, asked)
    node.has_damping = asked.read(at.DAMPING) is not None
    if drive.motor_counts_per_turn is not None and asked.read(at.MOTOR_POSITION) is None:
        raise ConfigError(
            f"drives.toml gives motor_counts_per_turn of {drive.joint}, but its drive (node {drive.node}) has no "
            f"{at.MOTOR_POSITION}. Remove the line, or connect the motor's encoder as the drive's additional one."
        )
    _map_all(drives, node, asked, asked.read(at.TEMPERATURE) is not None)
    if code := asked.read(at.ERROR_CODE):
        node.hold_against(fault_of(code), code)
    return notes


def must(drive: Drive, asked: SdoNode, entry: Entry, value: int, otherwise: str) -> None:
    """Write a setting that the drive must have.

    Raises:
        RigError: The drive lacks the setting, or holds another value afterwards.
    """
    if not asked.write(entry, value):
        raise RigError(
            f"The drive of {drive.joint} (node {drive.node}) does not take {value} in {entry}: {otherwise}. "
            "docs/howto/canopen.md lists what a drive has to support."
        )


def _check_identity(drive: Drive, asked: SdoNode) -> None:
    kind = asked.read(at.DEVICE_TYPE) or 0
    if kind & 0xFFFF != at.IS_402:
        raise RigError(
            f"Node {drive.node} is not the drive of {drive.joint}: its device type is {kind & 0xFFFF}, CiA 402 has "
            f"{at.IS_402}. Correct the node's number in drives.toml."
        )
    modes = asked.read(at.SUPPORTED_MODES)
    if modes is not None and not modes >> (at.CYCLIC_TORQUE - 1) & 1:
        raise RigError(
            f"The drive of {drive.joint} (node {drive.node}) has no cyclic synchronous torque mode (0x6502 is "
            f"0x{modes:08x}). Update its firmware, or use another drive."
        )


def _check_nameplate(drive: Drive, asked: SdoNode) -> None:
    rated = asked.read(at.RATED_CURRENT)
    if rated is None or abs(1e-3 * rated - drive.current_rated_A) > RATED_TOLERANCE * drive.current_rated_A:
        says = (
            "does not report a rated current" if rated is None else f"is set to a rated current of {1e-3 * rated:g} A"
        )
        raise ConfigError(
            f"The drive of {drive.joint} (node {drive.node}) {says} (0x6075), but drives.toml has current_rated_A = "
            f"{drive.current_rated_A:g}: every torque would be wrong by their ratio. Set both to the rated current in "
            "the motor's data sheet."
        )


def _reactions(drives: Drives, drive: Drive, asked: SdoNode) -> tuple[str, ...]:
    """Set the watchdogs, and the drive's reactions when they trip."""
    patience = round(drives.settings.watchdog_ms)
    asked.write(at.HEARTBEAT_MS, patience)
    asked.write(at.ERROR_BEHAVIOUR, GO_ON_TELLING)
    watches = asked.write(_timer(1), patience)
    heard = asked.write(at.HEARTBEAT_WATCHED, at.MASTER << 16 | patience)
    if not (watches or heard):
        raise RigError(
            f"The drive of {drive.joint} (node {drive.node}) can watch neither our commands ({_timer(1)}) nor our "
            f"heartbeat ({at.HEARTBEAT_WATCHED}): it would keep its last torque when this program ends. Do not use "
            "such a drive."
        )
    wanted = ((at.CONNECTION_LOST, ABORT_IS_FAULT), (at.QUICK_STOP, SLOW_DOWN_ON_RAMP))
    wanted += ((at.FAULT_REACTION, SLOW_DOWN_ON_RAMP),)
    refused = [str(entry) for entry, value in wanted if not asked.write(entry, value)]
    notes = [f"{drive.joint}: the drive has its own reaction in place of {entry}" for entry in refused]
    notes += [] if watches else [f"{drive.joint}: the drive watches our heartbeat only, not its commands"]
    return tuple(notes)


def _map_all(drives: Drives, node: CanopenNode, asked: SdoNode, has_temperature: bool) -> None:
    drive, command = node.drive, (*at.COMMAND, at.DAMPING) if node.has_damping else at.COMMAND
    _map(drive, asked, 0x1400, CobId.COMMAND + drive.node, AT_ONCE, command)
    _map(drive, asked, 0x1800, CobId.MEASURED + drive.node, WITH_EACH_SYNC, at.MEASURED)
    if drives.rad_per_motor_count is not None:
        _map(drive, asked, 0x1801, CobId.MOTOR + drive.node, WITH_EACH_SYNC, at.MOTOR)
    if has_temperature:
        _map(drive, asked, 0x1802, CobId.SLOW + drive.node, at.SLOW_SYNCS, at.SLOW)


def _map(drive: Drive, asked: SdoNode, where: int, cob: int, kind: int, entries: tuple[Entry, ...]) -> None:
    """Map one PDO, which is invalid while it changes, as CiA 301 requires."""
    number, mapping = Entry(where, 1, "I"), where + 0x200
    asked.write(number, INVALID | cob)
    asked.write(Entry(mapping, 0, "B"), 0)
    otherwise = f"the frame 0x{cob:03X} cannot be made"
    must(drive, asked, Entry(where, 2, "B"), kind, otherwise)
    for i, entry in enumerate(entries, start=1):
        must(drive, asked, Entry(mapping, i, "I"), entry.mapping, otherwise)
    must(drive, asked, Entry(mapping, 0, "B"), len(entries), otherwise)
    must(drive, asked, number, cob, otherwise)


def _timer(number: int) -> Entry:
    """Entry of a received PDO's event timer: time without the frame after which the drive reports a time-out [ms]."""
    return Entry(0x1400 + number - 1, 5, "H")
