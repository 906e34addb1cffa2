"""Record that the Python driver and its C translation share: session, measurement and counts of one controller.

    python -m exograv.rig.drives.udp.native.record

The command writes `record.h` from the classes and from `layout.py`. A test fails where they differ.
"""

import ctypes
from collections.abc import Mapping
from pathlib import Path

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.native.record import DriveMachine
from exograv.rig.drives.udp import host, layout, link
from exograv.rig.drives.udp.layout import LAYOUTS, Flag, Type
from exograv.rig.drives.udp.packets import Refusal
from exograv.safety.native.structs import header

HEADER = Path(__file__).with_name("record.h")

JOINTS = layout.JOINTS_MAX

COUNTS = (*(reason.value for reason in Refusal), "late or lost states", "not sent", "not heard")
"""Reasons that the link counts, in the order of `counts` in the record."""


class UdpAsked(ctypes.Structure):
    """Poll that was sent, or state that answered it."""

    _fields_ = [("sequence", ctypes.c_int64), ("tick", ctypes.c_int64), ("t", ctypes.c_double)]


class UdpJoint(ctypes.Structure):
    """Newest report of one drive, in its own units and directions."""

    _fields_ = [
        ("position", ctypes.c_double),
        ("motor_position", ctypes.c_double),
        ("current", ctypes.c_double),
        ("temperature", ctypes.c_double),
        ("fault", ctypes.c_int64),
        ("code", ctypes.c_int64),
        ("is_wanted", ctypes.c_int64),
        ("counts_samples", ctypes.c_int64),
        ("sample", ctypes.c_int64),
        ("sampled_at", ctypes.c_double),
    ]


class UdpDrives(ctypes.Structure):
    """Controller, as `UdpRig` and its `Link` know it. While the C loop runs, only C changes it."""

    _anonymous_ = ("machine",)
    _fields_ = [
        ("machine", DriveMachine),
        ("lost_s", ctypes.c_double),
        ("stale_s", ctypes.c_double),
        ("watchdog_s", ctypes.c_double),
        ("session", ctypes.c_uint32),
        ("grant", ctypes.c_uint32),
        ("sequence", ctypes.c_uint32),
        ("heard", ctypes.c_uint32),
        ("taken", ctypes.c_uint32),
        ("spare", ctypes.c_uint32),
        ("heard_at", ctypes.c_double),
        ("polls", UdpAsked * link.REMEMBERED),
        ("states", UdpAsked * link.REMEMBERED),
        ("each", UdpJoint * JOINTS),
        ("counts", ctypes.c_int64 * len(COUNTS)),
    ]


def constants() -> Mapping[str, float | int]:
    """Return the constants of the protocol and of the link, by their name in C."""
    named: dict[str, float | int] = {
        "UDP_MAGIC": layout.MAGIC,
        "UDP_VERSION": layout.VERSION,
        "UDP_JOINTS_MAX": JOINTS,
        "UDP_CRC_BYTES": layout.CRC_BYTES,
        "UDP_REMEMBERED": link.REMEMBERED,
        "UDP_READ_AT_ONCE": link.READ_AT_ONCE,
        "UDP_BUFFER": link.BUFFER,
        "UDP_FAULTS": int(host.FAULTS),
        "UDP_LOST": int(DriveFault.LOST),
        "UDP_PRESENT": int(layout.DriveFlag.PRESENT),
        "UDP_ENABLED": int(layout.DriveFlag.ENABLED),
        "UDP_ENABLE": int(Flag.ENABLE),
    }
    named |= {f"UDP_{kind.name}": int(kind) for kind in Type}
    named |= {f"UDP_COUNT_{reason.name}": COUNTS.index(reason.value) for reason in Refusal}
    named |= {f"UDP_COUNT_{name}": COUNTS.index(text) for name, text in _OF_LINK.items()}
    named |= _places("HEADER", layout.HEADER, 0)
    for kind, own, joint in (
        ("STATE", layout.STATE, layout.STATE_JOINT),
        ("COMMAND", layout.COMMAND, layout.COMMAND_JOINT),
    ):
        of_kind = LAYOUTS[Type[kind]]
        named |= _places(kind, own, layout.HEADER_BYTES) | _places(f"{kind}_JOINT", joint, 0)
        named |= {
            f"UDP_{kind}_JOINTS_AT": of_kind.joints_at,
            f"UDP_{kind}_JOINT_BYTES": of_kind.size(1) - of_kind.size(0),
        }
    return named


_OF_LINK = {"LATE": "late or lost states", "NOT_SENT": "not sent", "NOT_HEARD": "not heard"}


def _places(name: str, fields: tuple[layout.PacketField, ...], begin: int) -> dict[str, int]:
    return {f"UDP_{name}_{field.upper()}_AT": at for field, at in layout.offsets(fields, begin).items()}


def text() -> str:
    """Return the contents of `record.h`."""
    return header((UdpAsked, UdpJoint, UdpDrives), constants(), ["../../native/machine.h"])


if __name__ == "__main__":
    HEADER.write_text(text(), encoding="utf-8")
