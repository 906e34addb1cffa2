"""Tables of every byte of the UDP protocol, from the layout that the driver uses."""

import enum
from collections.abc import Mapping
from typing import TypeVar

from exograv.rig.drive_status import SENTENCES
from exograv.rig.drives.udp.layout import (
    FLAG_MEANINGS,
    LAYOUTS,
    PARTS,
    PURPOSES,
    STATUS_MEANINGS,
    PacketField,
    length,
    offsets,
    packed,
)

AnyBits = TypeVar("AnyBits", bound=enum.IntFlag)

SIZES = (4, 16)
"""Numbers of joints for which the length of each packet is stated."""


def udp_tables() -> str:
    """Tables of packets, flags, header, fields and faults, as Markdown."""
    parts = ["Packets:", packets_table(), "`flags` of the header:", bits_table(FLAG_MEANINGS)]
    parts += ["Header:", fields_table(*PARTS["header"])]
    for kind, layout in LAYOUTS.items():
        if not layout.fields:
            continue
        own, joint = PARTS[kind.name.lower()], PARTS[f"{kind.name.lower()}_joint"]
        size = packed(layout.joint).size
        text = f"{kind.name}; the joints' blocks begin at byte {layout.joints_at} and have {size} bytes each:"
        parts += [text, fields_table(*own), f"Block of a joint in {kind.name}:", fields_table(*joint)]
    parts += ["`status` of a joint:", bits_table(STATUS_MEANINGS)]
    parts += ["`fault`; a drive with a fault gives no torque and brakes:", bits_table(SENTENCES)]
    return "\n\n".join(parts) + "\n"


def packets_table() -> str:
    """Table of the types of packets with their lengths."""
    lines = [
        f"| type | name | {' | '.join(f'bytes with {n} joints' for n in SIZES)} | purpose |",
        "|---|---|---|---|---|",
    ]
    for kind, purpose in PURPOSES.items():
        lengths = " | ".join(str(length(kind, n)) for n in SIZES)
        lines.append(f"| {kind.value} | {kind.name} | {lengths} | {purpose} |")
    return "\n".join(lines)


def fields_table(fields: tuple[PacketField, ...], begin: int) -> str:
    """Table of fields, the first of which lies at byte `begin`."""
    lines = ["| byte | field | type | unit | |", "|---|---|---|---|---|"]
    for field, at in zip(fields, offsets(fields, begin).values(), strict=True):
        kind = f"char[{packed((field,)).size}]" if field.kind == "char" else field.kind
        lines.append(f"| {at} | `{field.name}` | {kind} | {field.unit} | {field.meaning} |")
    return "\n".join(lines)


def bits_table(bits: Mapping[AnyBits, str]) -> str:
    """Table of bits with their meanings."""
    return "\n".join(
        ["| bit | name | |", "|---|---|---|"]
        + [f"| {bit.value} | {bit.name} | {meaning} |" for bit, meaning in bits.items()]
    )
