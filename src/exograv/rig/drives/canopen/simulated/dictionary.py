"""Object dictionary of a simulated drive: objects that can be read, and objects that can be set."""

from canopen import ObjectDictionary
from canopen import objectdictionary as kinds
from canopen.objectdictionary import ODRecord, ODVariable

U8, U16, U32, I8, I16, I32 = (
    kinds.UNSIGNED8,
    kinds.UNSIGNED16,
    kinds.UNSIGNED32,
    kinds.INTEGER8,
    kinds.INTEGER16,
    kinds.INTEGER32,
)

VENDOR, PRODUCT = 0, 0x65786F67
"""Vendor and product number; no maker has number 0."""

VARIABLES = (
    (0x1000, "device type", U32, "ro", 0x00020192),  # servo drive, CiA 402
    (0x1001, "error register", U8, "ro", 0),
    # Without 0x1017 `canopen` 2.4.1 raises KeyError when the node becomes pre-operational (canopen #672).
    (0x1017, "heartbeat time", U16, "rw", 0),
    (0x6007, "abort connection option", I16, "rw", 1),
    (0x603F, "error code", U16, "ro", 0),
    (0x6040, "control word", U16, "rw", 0),
    (0x6041, "status word", U16, "ro", 0),
    (0x605A, "quick stop option", I16, "rw", 2),
    (0x605E, "fault reaction option", I16, "rw", 2),
    (0x6060, "mode", I8, "rw", 0),
    (0x6061, "mode display", I8, "ro", 0),
    (0x6064, "position", I32, "ro", 0),
    (0x6071, "target torque", I16, "rw", 0),
    (0x6072, "max torque", U16, "rw", 1000),
    (0x6075, "rated current", U32, "ro", 0),
    (0x6076, "rated torque", U32, "ro", 0),
    (0x6077, "torque", I16, "ro", 0),
    (0x6502, "supported modes", U32, "ro", 1 << 9),
    (0x2100, "damping", U16, "rw", 0),
    (0x2101, "winding temperature", I16, "ro", 0),
)
RECORDS = (
    (0x1016, "consumer heartbeat", {1: (U32, "rw", 0)}),
    (0x1018, "identity", {1: (U32, "ro", VENDOR), 2: (U32, "ro", PRODUCT), 3: (U32, "ro", 1), 4: (U32, "ro", 1)}),
    (0x1029, "error behaviour", {1: (U8, "rw", 0)}),
    (0x60E4, "additional position", {1: (I32, "ro", 0)}),
)
RECEIVED, SENT = (0x1400,), (0x1800, 0x1801, 0x1802)
MAPPED_MOST = 4
INVALID = 1 << 31


def object_dictionary(without: frozenset[int]) -> ObjectDictionary:
    """Return the dictionary of one drive with its maker's settings; `without` are indices of objects that it lacks."""
    found = ObjectDictionary()
    for index, name, kind, access, value in VARIABLES:
        if index not in without:
            found.add_object(_variable(name, index, 0, kind, access, value))
    for index, name, members in RECORDS:
        if index not in without:
            found.add_object(_record(name, index, {0: (U8, "ro", len(members)), **members}))
    for index in (*RECEIVED, *SENT):
        timer = {} if index in without else {5: (U16, "rw", 0)}
        parameters = {0: (U8, "ro", 5), 1: (U32, "rw", INVALID), 2: (U8, "rw", 0xFF), **timer}
        found.add_object(_record(f"frame {index:x}", index, parameters))
        mapped = {0: (U8, "rw", 0), **dict.fromkeys(range(1, MAPPED_MOST + 1), (U32, "rw", 0))}
        found.add_object(_record(f"mapping {index:x}", index + 0x200, mapped))
    return found


def _record(name: str, index: int, members: dict[int, tuple[int, str, int]]) -> ODRecord:
    record = ODRecord(name, index)
    for sub, (kind, access, value) in members.items():
        record.add_member(_variable(f"{name} {sub}", index, sub, kind, access, value))
    return record


def _variable(name: str, index: int, sub: int, kind: int, access: str, value: int) -> ODVariable:
    variable = ODVariable(name, index, sub)
    variable.data_type, variable.access_type, variable.default = kind, access, value
    return variable
