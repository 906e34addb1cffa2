"""Generator of the page of channels: every field of a recording with its type and unit, from the schema."""

from .encoding import tick_definition
from .fields import POINTS, Channel, Field
from .schema import CHANNELS, SCHEMA_VERSION
from .stream_block import DEFINITION, TOPICS

INTRODUCTION = f"""\
# Channels of a recording

Version {SCHEMA_VERSION}, of `src/exograv/recording/schema.py`. Conventions: [recording format](../recording_format.md).
"""


STREAMS = f"""\
## `{TOPICS}…`: streams of other devices

Each stream of Lab Streaming Layer has one channel ([LSL](../../howto/lsl.md)), named after it. The number of streams is
fixed when the file begins. A message holds the samples of about a tenth of a second. The encoding is `cdr` with
sequences: a length of four bytes, then the entries, each value aligned to its own size, counted from the end of the
four bytes at the beginning. `values` has the stream's own type, `float32`, `float64` (LSL's `double64`), `int8`,
`int16`, `int32`, `int64` or `string`:

```
{DEFINITION.format(type="float32")}```

Stamps and values are never altered. LSL's estimates of the clock are in `/correction`, and `Recording.streams` has
stamps on the robot's clock (`t`) and on the computer's (`monotonic`) in further columns. Log times of these channels,
of `/stream` and of `/correction` are their times of arrival on the rig's clock; without a robot, on CLOCK_MONOTONIC.
"""


def format_document() -> str:
    """Text of the page, as Markdown."""
    binary = f"""\
## How a tick is packed

`/tick` is plain little-endian CDR, as ROS 2 uses it: four bytes `00 01 00 00`, then the fields of the table one after
another without padding or lengths. For a machine of four joints the schema in the file (`ros2msg`) reads

```
{tick_definition(4)}```
"""
    return "\n".join([INTRODUCTION, *(_section(channel) for channel in CHANNELS.values()), binary, STREAMS])


def _section(channel: Channel) -> str:
    head = f"## `{channel.topic}`\n\n{channel.meaning} Encoding `{channel.encoding}`, {channel.rate}.\n"
    rows = ["| field | type | unit | meaning |", "|---|---|---|---|", *_rows(channel.fields)]
    return "\n".join([head, *rows, ""])


def _rows(fields: tuple[Field, ...], prefix: str = "") -> list[str]:
    rows = []
    for field in fields:
        size = "".join(f"[{'' if length == 'any' else length}]" for length in field.size)
        remarks = ["may be absent"] if field.optional or field.nullable else []
        if field.nullable:
            remarks.append("null before version 3")
        if field.size == POINTS:
            remarks.append("each an object of `x`, `y`, `z`; before version 3 a list of the three")
        if field.since > 1:
            remarks.append(f"since version {field.since}; before, and if it is not given, {field.default:g}")
        if field.narrow_before > 1:
            remarks.append(f"float32 before version {field.narrow_before}")
        meaning = field.meaning + (f" ({', '.join(remarks)})" if remarks else "")
        rows.append(f"| `{prefix}{field.name}` | {field.type}{size} | {field.unit} | {meaning} |")
        rows += _rows(field.fields, f"{prefix}{field.name}{size}.")
    return rows
