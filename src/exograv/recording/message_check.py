"""Check of JSON messages against the table of channels, at every depth that the table describes."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError

from .encoding import restored
from .fields import EACH, POINTS, Channel, Field, Message

SINCE = 3
"""First version of the format whose messages the table describes in full. Older messages lack fields."""

SHOWN_MAX = 60
"""Most characters of a wrong value in a message."""

KINDS: dict[str, tuple[type, ...]] = {
    "string": (str,), "integer": (int,), "number": (int, float), "boolean": (bool,), "object": (dict,),
}  # fmt: skip
"""Python types of a JSON type; a boolean counts as a boolean only."""


def read_message(path: Path, channel: Channel, text: bytes, settings: Mapping[str, Any] | None = None) -> Message:
    """Return a message of a channel.

    Args:
        path: The recording, for messages.
        channel: Channel of the message.
        text: The message as JSON.
        settings: Settings of the recording; None for the settings themselves.

    Raises:
        RecordingError: A value is missing, or of another type or length than the table says.
        ValueError: The text is no JSON.
    """
    message = json.loads(text)
    if settings is not None and settings["schema_version"] < SINCE:
        return restored(channel.fields, message)
    wrong = wrong_value(channel.fields, message, _joints_of(message if settings is None else settings))
    if wrong is not None:
        raise RecordingError(
            f"{path} is damaged: in its {channel.topic} {wrong} Give the recording as exograv wrote it."
        )
    return message if settings is None else restored(channel.fields, message)


def _joints_of(settings: object) -> int | None:
    """Return the number of joints that settings name; None if they name none."""
    joints = settings.get("joints") if isinstance(settings, Mapping) else None
    return len(joints) if isinstance(joints, list) else None


def wrong_value(fields: tuple[Field, ...], message: object, n_joints: int | None = None, place: str = "") -> str | None:
    """Return a sentence about the first value of a JSON message that is missing, or of another type or length.

    Values that the table does not have are allowed: another version may have written them.

    Args:
        fields: Fields of the message.
        message: The message.
        n_joints: Length of a list per joint; None if it is not known.
        place: Names of the objects around the message, each with a dot.

    Returns:
        The sentence; None if all values fit.
    """
    if not isinstance(message, dict):
        name = f"'{place.removesuffix('.')}'" if place else "the message"
        return f"{name} is {_shown(message)}, not an object."
    for field in fields:
        if field.name == EACH:
            named = {one.name for one in fields}
            wrongs = (_wrong(field, message[name], place + name, n_joints) for name in message if name not in named)
        elif message.get(field.name) is not None:
            wrongs = iter([_wrong(field, message[field.name], place + field.name, n_joints)])
        else:
            is_needed = not (field.optional or field.nullable)
            wrongs = iter([f"'{place}{field.name}' is missing."] if is_needed else [])
        if (wrong := next(filter(None, wrongs), None)) is not None:
            return wrong
    return None


def _wrong(field: Field, value: Any, name: str, n_joints: int | None) -> str | None:
    """Return a sentence about a value that does not fit the description of its field; None if it fits."""
    if field.size:
        return next(_wrong_in_list(field, value, name, n_joints), None)
    if not _is_of(field.type, value):
        return f"'{name}' is {_shown(value)}, not of the type {field.type}."
    if field.is_positive and not 0.0 < value < math.inf:
        return f"'{name}' is {value}; it must be above 0."
    inside = field.fields or field.known
    return wrong_value(inside, value, n_joints, f"{name}.") if inside else None


def _wrong_in_list(field: Field, value: object, name: str, n_joints: int | None) -> Iterator[str]:
    if not isinstance(value, list):
        yield f"'{name}' is {_shown(value)}, not a list of values of the type {field.type}."
        return
    length = n_joints if field.size[0] == "joint" else field.size[0]
    if isinstance(length, int) and len(value) != length:
        yield f"'{name}' has {len(value)} values, not {length}."
    # In the file a point is an object with x, y and z; before version 3 it was a list.
    values = [list(one.values()) if isinstance(one, dict) else one for one in value] if field.size == POINTS else value
    inner = replace(field, size=field.size[1:])
    for k, one in enumerate(values):
        if one is None and field.holes:
            continue
        if (wrong := _wrong(inner, one, f"{name}[{k}]", n_joints)) is not None:
            yield wrong


def _is_of(kind: str, value: object) -> bool:
    return isinstance(value, KINDS[kind]) and isinstance(value, bool) == (kind == "boolean")


def _shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= SHOWN_MAX else f"{text[:SHOWN_MAX]}…"
