"""Results of commands: typed dataclasses inside the package, JSON values at its border."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

JsonObject = dict[str, Any]
"""Object of JSON with members that only its writer knows: a message, the settings of a recording, a file's content.

A room that passes it on cannot know its members: they depend on the command, or on the version that wrote the file.
"""

OPTIONAL = {"exograv": "optional"}
"""Metadata of a field whose key is left out of the JSON object while its value is None."""

MERGED = {"exograv": "merged"}
"""Metadata of a field whose members are written directly into the JSON object of the result.

A merged field that is None adds nothing.
"""


def json_value(value: Any) -> Any:
    """Convert a result to values that `json.dumps` accepts.

    Dataclasses become objects with their fields in order, arrays and tuples become lists.

    Raises:
        TypeError: A member has a type without a JSON form.
    """
    if value is None or isinstance(value, str | bool | int | float):
        return value.value if isinstance(value, Enum) else value
    if hasattr(value, "tolist"):  # Arrays and scalars of NumPy. `--help` must not wait for the import of NumPy.
        return value.tolist()
    if hasattr(value, "model_dump"):  # settings of pydantic
        return value.model_dump(mode="json")
    if is_dataclass(value) and not isinstance(value, type):
        return _object(value)
    if isinstance(value, Mapping):
        return {str(json_value(key)): json_value(one) for key, one in value.items()}
    if isinstance(value, Sequence | set | frozenset):
        return [json_value(one) for one in value]
    if isinstance(value, Enum):
        return json_value(value.value)
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no JSON form.")


def _object(result: Any) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for one in fields(result):
        value = getattr(result, one.name)
        if one.metadata == MERGED:
            made |= {} if value is None else json_value(value)
        elif value is not None or one.metadata != OPTIONAL:
            made[one.name] = json_value(value)
    return made
