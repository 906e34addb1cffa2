"""Conversion of the table of channels to a packed record, its ROS 2 definition, and JSON schemas."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from exograv.errors import RecordingError

from .fields import AXES, JOINT, POINTS, Channel, Field
from .schema import SCHEMA_VERSION, TICK

CDR_HEADER = b"\x00\x01\x00\x00"
"""Encapsulation of every binary message: plain CDR, little-endian."""

TICK_DEFAULTS = {field.name: field.default for field in TICK.fields if field.default is not None}
"""Default values of the fields of a tick that may be omitted."""


def tick_dtype(n_joints: int, version: int = SCHEMA_VERSION) -> np.dtype:
    """Return the type of one `/tick` message: the CDR header, then the fields of the table in that version.

    CDR aligns each value to its own size, counted from the end of the header. In the order of the table values of eight
    bytes begin at multiples of eight, so there is no padding. Arrays of fixed size carry no length.
    """
    types: dict[str, Any] = {"float64": "<f8", "float32": "<f4", "uint32": "<u4"}
    shape = {(): (), JOINT: (n_joints,)}
    columns = [
        (field.name, types["float32" if version < field.narrow_before else field.type], shape[field.size])
        for field in TICK.fields
        if field.since <= version
    ]
    return np.dtype([("cdr_header", "u1", (4,)), *columns])


def empty_ticks(n: int, n_joints: int) -> np.ndarray:
    """Return ticks (tick,) with the default of each field that has one, and zero elsewhere."""
    ticks = np.zeros(n, tick_dtype(n_joints))
    for name, value in TICK_DEFAULTS.items():
        ticks[name] = value
    ticks["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
    return ticks


def stored_rows(data: bytes | bytearray, n_joints: int, version: int) -> np.ndarray:
    """Return ticks (tick,) as the file stores them in this version.

    Raises:
        RecordingError: The ticks are of another number of joints.
    """
    row = tick_dtype(n_joints, version)
    if len(data) % row.itemsize:
        raise RecordingError(
            f"The recording is damaged: its /settings name {n_joints} joints, and its ticks have another number. Give "
            "the recording as exograv wrote it."
        )
    return np.frombuffer(data, row)


def unpacked_ticks(data: bytes | bytearray, n_joints: int, version: int) -> np.ndarray:
    """Return ticks (tick,) of this version as records of the present one; missing fields have their defaults.

    Raises:
        RecordingError: The ticks are of another number of joints.
    """
    stored = stored_rows(data, n_joints, version)
    if version >= SCHEMA_VERSION:
        return stored
    ticks = np.zeros(len(stored), tick_dtype(n_joints))
    for name in ticks.dtype.names or ():
        ticks[name] = stored[name] if name in (stored.dtype.names or ()) else TICK_DEFAULTS[name]
    return ticks


def tick_definition(n_joints: int) -> str:
    """Return the `/tick` message in ROS 2's interface language, for viewers without knowledge of exograv."""
    array = {(): "", JOINT: f"[{n_joints}]"}
    return "\n".join(f"{f.type}{array[f.size]} {f.name}  # {f.meaning} [{f.unit}]" for f in TICK.fields) + "\n"


def json_schema(fields: tuple[Field, ...], n_joints: int) -> dict[str, Any]:
    """Return the JSON Schema of an object with these fields, in the subset that Foxglove and its descendants support.

    Source: `parseJsonSchema.ts` of Foxglove Studio 1.x. Each object has `properties`, a type is one word, and no array
    is in an array.
    """
    return {
        "type": "object",
        "properties": {field.name: _json_property(field, n_joints) for field in fields},
        "required": [field.name for field in fields if not (field.optional or field.nullable)],
        "additionalProperties": False,
    }


def _json_property(field: Field, n_joints: int) -> dict[str, Any]:
    item: dict[str, Any] = {"type": field.type}
    if field.type == "object":
        item = json_schema(field.fields, n_joints) if field.fields else {"type": "object", "properties": {}}
    size = field.size
    if size == POINTS:
        item, size = json_schema(AXES, n_joints), size[:1]
    for length in reversed(size):
        item = {"type": "array", "items": item}
        if length != "any":
            item["minItems"] = item["maxItems"] = n_joints if length == "joint" else length
    item["description"] = f"{field.meaning} [{field.unit}]"
    return item


def stored(fields: tuple[Field, ...], message: Mapping[str, Any]) -> dict[str, Any]:
    """Return a message in the form of the file: null values are left out, and a point is an object."""
    known, found = {field.name: field for field in fields}, {}
    for name, value in message.items():
        field = known[name]
        if value is None:
            # A null in another field is a mistake of the caller, which the file then shows.
            found |= {} if field.nullable else {name: None}
        elif field.size == POINTS:
            found[name] = [dict(zip("xyz", point, strict=True)) for point in value]
        elif field.fields:
            found[name] = [stored(field.fields, one) for one in value]
        else:
            found[name] = value
    return found


def restored(fields: tuple[Field, ...], message: Mapping[str, Any]) -> dict[str, Any]:
    """Return the message from which `stored` made this one; messages of versions before 3 stay unchanged."""
    absent = {field.name: None for field in fields if field.nullable and not field.optional}
    found: dict[str, Any] = absent | dict(message)
    for field in fields:
        value = found.get(field.name)
        if not isinstance(value, list):
            continue
        if field.fields:
            found[field.name] = [restored(field.fields, one) for one in value]
        elif field.size == POINTS:
            found[field.name] = [list(point.values()) if isinstance(point, dict) else point for point in value]
    return found


def misfits(channel: Channel, message: Mapping[str, Any]) -> list[str]:
    """Names that the table does not allow in this message, or that the message lacks; empty if the message fits."""
    known = {field.name for field in channel.fields}
    needed = {field.name for field in channel.fields if not field.optional}
    unknown = [f"unknown '{name}'" for name in message if name not in known]
    return unknown + [f"missing '{name}'" for name in sorted(needed - message.keys())]
