"""Generator of the page of channels: every field of a recording with its type and unit, from the schema."""

from .encoding import tick_definition
from .fields import POINTS, Channel, Field
from .schema import CHANNELS, PACKED_VERSION, SCHEMA_VERSION
from .stream_block import DEFINITION, TOPICS
from .tick_columns import COLUMNS_ENCODING, COLUMNS_TOPIC, OF_CURRENT, OF_OTHER, ORDERS, VIEWED_EVERY

INTRODUCTION = f"""\
# Channels of a recording

Version {SCHEMA_VERSION}, of `src/exograv/recording/schema.py`. Conventions: [recording format](../recording_format.md).
"""


PACKED = f"""\
## `{COLUMNS_TOPIC}`: ticks packed by column

The recordings of `exograv demo` and `exograv arm identify` have version {PACKED_VERSION}: their ticks are packed by
column, which takes about half of the space of rows. The messages of all other channels are those of version
{SCHEMA_VERSION}. Each chunk has one message of the encoding `{COLUMNS_ENCODING}` with all its ticks, exact to the last
bit. Every {VIEWED_EVERY}th tick is a plain `/tick` message too, so that a viewer still shows the run; a reader that
unpacks the columns ignores these. A message is little-endian and holds

1. three uint32: number of ticks, number of joints, and the version of the table of `/tick`,
2. one byte per column, its method; the columns are the fields of the table in order, and joint by joint for `[joint]`,
3. one float64 per joint: the factor of method {OF_CURRENT},
4. the columns: for each, the lowest byte of all ticks, then the next byte of all ticks, and so on.

The bytes of a column are unsigned numbers 0, 1, 2, 3, … that stand for 0, −1, 1, −2, …. To unpack them:

- Methods 0 to {ORDERS - 1}: sum them up along the ticks as often as the method says; integers wrap around.
- Method {OF_OTHER}, `tau_commanded` only: add the integers of `tau_desired`.
- Method {OF_CURRENT}, `tau_measured` only: add the integers of `current` times the factor, rounded to float32.

The integer of a float is its bit pattern as a signed integer; if it is negative, all bits but the sign are inverted.
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
    return "\n".join([INTRODUCTION, *(_section(channel) for channel in CHANNELS.values()), binary, PACKED, STREAMS])


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
