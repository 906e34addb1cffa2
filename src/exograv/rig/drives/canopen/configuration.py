"""Before anything moves: each drive is looked at and set up, by questions (SDO) that nobody asks again in the loop."""

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.settings import Drive, Drives

from . import objects as at
from .emergency import fault_of
from .network import SdoNode
from .node import CanopenNode
from .objects import CobId, Entry

ABORT_IS_FAULT, SLOW_DOWN_ON_RAMP, GO_ON_TELLING = 1, 2, 1
"""A lost connection is a fault; it, as a quick stop, ends the motion on the quick-stop ramp; TPDOs go on."""

RATED_TOLERANCE = 0.01
"""Of the rated current, between drive and file: beyond, every torque would be wrong by as much."""

WITH_EACH_SYNC, AT_ONCE = 1, 0xFF
"""Transmission types: what a drive measures comes with each SYNC; what it is told counts when it arrives, not with the
next SYNC, or it would be a period older."""

INVALID = 1 << 31
"""Of a PDO's number: it is being changed."""


def configure(drives: Drives, node: CanopenNode, asked: SdoNode) -> tuple[str, ...]:
    """Check one drive against `drives.toml` and set it up; it is pre-operational and stays so.

    Returns:
        What it cannot that others can, in sentences.

    Raises:
        RigError: It does not answer, cannot do what is needed, or refuses a setting.
        ConfigError: `drives.toml` says of it what is not so.
    """
    drive = node.drive
    _check_identity(drive, asked)
    _check_nameplate(drive, asked)
    must(drive, asked, at.MODE, at.CYCLIC_TORQUE, "it has no cyclic synchronous torque mode")
    # Above its greatest torque the drive cuts; the file's limit is the smaller or the same.
    most = round(1000.0 * drive.current_max_A / drive.current_rated_A)
    must(drive, asked, at.MAX_TORQUE, most, "its torque would not be limited")
    notes = _reactions(drives, drive, asked)
    node.has_damping = asked.read(at.DAMPING) is not None
    if drive.motor_counts_per_turn is not None and asked.read(at.MOTOR_POSITION) is None:
        raise ConfigError(
            f"drives.toml gives motor_counts_per_turn of {drive.joint}, and its drive (node {drive.node}) has no "
            f"{at.MOTOR_POSITION}. Remove the line, or connect the motor's encoder as the drive's additional one."
        )
    _map_all(drives, node, asked, asked.read(at.TEMPERATURE) is not None)
    if code := asked.read(at.ERROR_CODE):
        node.hold_against(fault_of(code), code)
    return notes


def must(drive: Drive, asked: SdoNode, entry: Entry, value: int, otherwise: str) -> None:
    """Set what the drive has to have.

    Raises:
        RigError: It has it not, or holds another value afterwards.
    """
    if not asked.write(entry, value):
        raise RigError(
            f"The drive of {drive.joint} (node {drive.node}) does not take {value} in {entry}: {otherwise}. "
            "docs/canopen.md lists what a drive has to support."
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
            f"0x{modes:08x}). Its firmware has to bring it, or another drive."
        )


def _check_nameplate(drive: Drive, asked: SdoNode) -> None:
    rated = asked.read(at.RATED_CURRENT)
    if rated is None or abs(1e-3 * rated - drive.current_rated_A) > RATED_TOLERANCE * drive.current_rated_A:
        says = "does not tell a rated current" if rated is None else f"is set to a rated current of {1e-3 * rated:g} A"
        raise ConfigError(
            f"The drive of {drive.joint} (node {drive.node}) {says} (0x6075), and drives.toml has current_rated_A = "
            f"{drive.current_rated_A:g}: every torque would be wrong by their ratio. Set both to what the motor's "
            "data sheet says."
        )


def _reactions(drives: Drives, drive: Drive, asked: SdoNode) -> tuple[str, ...]:
    """Watchdogs, and what the drive does when they trip."""
    patience = round(drives.settings.watchdog_ms)
    asked.write(at.HEARTBEAT_MS, patience)
    asked.write(at.ERROR_BEHAVIOUR, GO_ON_TELLING)
    watches = asked.write(_timer(1), patience)
    heard = asked.write(at.HEARTBEAT_WATCHED, at.MASTER << 16 | patience)
    if not (watches or heard):
        raise RigError(
            f"The drive of {drive.joint} (node {drive.node}) can watch neither our commands ({_timer(1)}) nor our "
            f"heartbeat ({at.HEARTBEAT_WATCHED}): it would go on with its last torque when this program ends. Such a "
            "drive is not to be used."
        )
    wanted = ((at.CONNECTION_LOST, ABORT_IS_FAULT), (at.QUICK_STOP, SLOW_DOWN_ON_RAMP))
    wanted += ((at.FAULT_REACTION, SLOW_DOWN_ON_RAMP),)
    refused = [str(entry) for entry, value in wanted if not asked.write(entry, value)]
    notes = [f"{drive.joint}: the drive decides itself what {entry} would say" for entry in refused]
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
    """One PDO: invalid while it changes, as CiA 301 wants it."""
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
    """After how many ms without the frame a drive has been told nothing for too long."""
    return Entry(0x1400 + number - 1, 5, "H")
