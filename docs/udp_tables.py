"""Tables of every byte of the UDP protocol, from the layout that the driver uses."""

from collections.abc import Mapping

from exograv.rig.drive_status import SENTENCES, DriveFault
from exograv.rig.drives.udp.layout import LAYOUTS, PARTS, PacketField, offsets, packed


def udp_tables() -> str:
    """Tables of header, packets and faults, as Markdown."""
    parts = ["Header:", fields_table(*PARTS["header"])]
    for kind, layout in LAYOUTS.items():
        if not layout.fields:
            continue
        own, joint = PARTS[kind.name.lower()], PARTS[f"{kind.name.lower()}_joint"]
        size = packed(layout.joint).size
        text = f"{kind.name}; the joints' blocks begin at byte {layout.joints_at} and have {size} bytes each:"
        parts += [text, fields_table(*own), f"Block of a joint in {kind.name}:", fields_table(*joint)]
    parts += ["`fault`; a drive with a fault gives no torque and brakes:", bits_table(SENTENCES)]
    return "\n\n".join(parts) + "\n"


def fields_table(fields: tuple[PacketField, ...], begin: int) -> str:
    """Table of fields, the first of which lies at byte `begin`."""
    lines = ["| byte | field | type | unit | |", "|---|---|---|---|---|"]
    for field, at in zip(fields, offsets(fields, begin).values(), strict=True):
        kind = f"char[{packed((field,)).size}]" if field.kind == "char" else field.kind
        lines.append(f"| {at} | `{field.name}` | {kind} | {field.unit} | {field.meaning} |")
    return "\n".join(lines)


def bits_table(bits: Mapping[DriveFault, str]) -> str:
    """Table of bits with their meanings."""
    return "\n".join(
        ["| bit | name | |", "|---|---|---|"]
        + [f"| {bit.value} | {bit.name} | {meaning} |" for bit, meaning in bits.items()]
    )
