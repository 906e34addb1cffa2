"""Types for the rows of the table of channels."""

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import fields as fields_in
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

Message = Mapping[str, Any]
"""JSON message as in the file; recordings are read at the border, and older ones hold other fields."""

Row = TypeVar("Row")

Size = tuple[str | int, ...]
"""Length of each dimension: a number, `joint` (actuated joints of the file) or `any`; () is a single value."""


@dataclass(frozen=True)
class Field:
    """Value of a message."""

    name: str
    type: str
    """ROS 2 type (`float64`, `float32`, `uint32`) in a binary channel, JSON type otherwise.

    An `object` holds `fields`, or anything if there are none.
    """

    unit: str
    meaning: str
    size: Size = ()
    optional: bool = False
    """True if the value may be absent."""

    nullable: bool = False
    """True if the value may be null: requested, and not reached or not known. The file then leaves it out."""

    fields: "tuple[Field, ...]" = ()

    known: "tuple[Field, ...]" = ()
    """Fields that a reader uses of an `object` with any content; `EACH` describes all fields without their own row."""

    is_positive: bool = False
    """True if a number must be above zero and finite."""

    holes: bool = False
    """True if a list may hold null for a value that is not finite."""

    since: int = 1
    """First version of the format in which a tick has the field."""

    default: float | None = None
    """Value in a tick that omits the field, or is older than it; None if each tick must have it."""

    narrow_before: int = 1
    """First version of the format that stores this `float64` of a tick without rounding it to `float32`."""


@dataclass(frozen=True)
class Channel:
    """Stream of messages of one kind."""

    topic: str
    encoding: str
    """Encoding: `cdr` (binary, one message per tick) or `json`."""

    rate: str
    meaning: str
    fields: tuple[Field, ...]

    @property
    def schema_name(self) -> str:
        """Name of the message type in the file."""
        return f"exograv/msg/{self.topic.strip('/').title().replace('_', '')}"


EACH = "*"
"""Name of a field that describes all fields of an object without a row of their own."""

T = Field("t", "number", "s", "time on the rig's clock")
JOINT: Size = ("joint",)
LIST: Size = ("any",)
POINTS: Size = ("any", 3)
AXES = tuple(Field(axis, "number", "m", "of a point") for axis in "xyz")
"""Fields of a point in the file."""

JSON_TYPES: dict[object, str] = {int: "integer", float: "number", int | float: "number", bool: "boolean"}


def described(row: type) -> dict[str, tuple[Any, ...]]:
    """Type and texts of the fields of a dataclass that are `Annotated[type, meaning, …]`, by name."""
    hints = get_type_hints(row, include_extras=True)
    return {one.name: get_args(hints[one.name]) for one in fields_in(row) if get_origin(hints[one.name]) is Annotated}


def fields_of(message: type) -> tuple[Field, ...]:
    """Return the fields of a dataclass of messages: `Annotated[type, meaning]` or `Annotated[type, meaning, unit]`.

    A list may have any length. A field that may be None may be absent.
    """
    return tuple(_field(name, *told) for name, told in described(message).items())


def _field(name: str, annotation: Any, meaning: str, unit: str = "-") -> Field:
    is_optional = NoneType in get_args(annotation)
    kind = next(one for one in get_args(annotation) if one is not NoneType) if is_optional else annotation
    is_list = get_origin(kind) is list
    type_ = JSON_TYPES.get(get_args(kind)[0] if is_list else kind, "string")
    return Field(name, type_, unit, meaning, LIST if is_list else (), is_optional)


def read_as(row: type[Row], message: Message) -> Row:
    """Return a message as a dataclass; names that the dataclass does not have are left out."""
    return row(**{name: message[name] for name in described(row) if name in message})
