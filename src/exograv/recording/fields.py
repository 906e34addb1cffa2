"""What a row of the table of channels is made of."""

from dataclasses import dataclass

Size = tuple[str | int, ...]
"""Length of each dimension: a number, `joint` (actuated joints of the file) or `any`; () is a single value."""


@dataclass(frozen=True)
class Field:
    """One value of a message."""

    name: str
    type: str
    """A ROS 2 type (`float64`, `float32`, `uint32`) in a binary channel, a JSON type otherwise.

    An `object` holds `fields`, or anything if there are none.
    """

    unit: str
    meaning: str
    size: Size = ()
    optional: bool = False
    """May be absent."""

    nullable: bool = False
    """May be null: asked for, and not reached or not known. In the file it is then left out."""

    fields: "tuple[Field, ...]" = ()

    since: int = 1
    """Version of the format from which on a tick has it."""

    default: float | None = None
    """Of a tick that does not say, or is older than the field; None where every tick must."""

    narrow_before: int = 1
    """Before this version of the format a `float64` of a tick was stored as `float32`."""


@dataclass(frozen=True)
class Channel:
    """One stream of messages."""

    topic: str
    encoding: str
    """`cdr` (binary, one message a tick) or `json`."""

    rate: str
    meaning: str
    fields: tuple[Field, ...]

    @property
    def schema_name(self) -> str:
        """Name of the message type in the file."""
        return f"exograv/msg/{self.topic.strip('/').title().replace('_', '')}"


T = Field("t", "number", "s", "time on the rig's clock")
JOINT: Size = ("joint",)
LIST: Size = ("any",)
POINTS: Size = ("any", 3)
AXES = tuple(Field(axis, "number", "m", "of a point") for axis in "xyz")
"""What a point is in the file."""
