"""docs/reference/recording_format.md, made from the table. `python -m exograv.recording.document` prints it."""

from .encoding import tick_definition
from .fields import POINTS, Channel, Field
from .schema import CHANNELS, SCHEMA_VERSION
from .stream_block import DEFINITION, TOPICS
from .writer import SYNC_EVERY_S

INTRODUCTION = f"""\
# Recording format

Made from the table in `src/exograv/recording/schema.py`; a test fails when the two differ. To renew it:
`python -m exograv.recording.document > docs/reference/recording_format.md`

A recording is one [MCAP](https://mcap.dev) file, version {SCHEMA_VERSION} of this format (`schema_version` in
`/settings`); older versions are still read. It is written while the run goes on, in chunks of at most about 1 MB
(zstd): what is killed loses at most its last chunk, and the reader says so. A live recording is forced to the disk
every {1e3 * SYNC_EVERY_S:.0f} ms, and its recorder, if killed, goes on in the same file
([realtime.md](../explanation/realtime.md)). It holds no wall-clock time. Log times are the rig's clock in nanoseconds, so the same
seed gives the same messages, but for `tick_us`, `lateness_us` and `monotonic`.

Each chunk has a checksum and an index that must agree with it; a complete file has a checksum over all that was
written, and one over its summary. What does not agree is left out, with all that follows, and reported.

Values are SI unless the unit beside them says otherwise. `[joint]` is one entry per actuated joint, in the order of
`joints` in `/settings`. Torque is positive along the joint's axis, and is what the motor adds. Each channel carries
its own schema in the file, so that a viewer that knows nothing of exograv can open it: Foxglove and Lichtblick,
PlotJuggler, and every reader of MCAP with `ros2msg` and JSON Schema.

## Replay

    exograv replay FILE [--json P] [--out DIR] [--person FILE] [--calibration FILE] [--gravity-level G] [--rig R]

lets control and guard decide once more on what a recording of `exograv demo`, `identify` or `live` measured: it makes
the machine from the files in `/settings`, controllers and observer from `/control` (of a live run, from
`settings.live`, and from `/control` what a worker found), the guard with what it held the person to, and feeds the
ticks one by one. Numbers are stored
without rounding, so the same code on the same computer decides the same to the last bit; the answer says so, or names
the first tick, torque and joint that differ by more than 1e-6 N·m, other safe states and stops, and what is not as it
was (versions, hash of the code, the machine's files, missing ticks). The exit status is then 1. The figure shows
torque and difference, by joint, with the phases. What it cannot make anew is the torque of the first pushes of a
calibration, a script without feedback: there the recorded one goes through the guard. Where ticks are missing,
filters begin anew, and half a second is not compared. A file that was cut or damaged is replayed up to its last good
record. With an option the same ticks are decided as they would have been with another person (a file of `exograv
identify --keep`, from the first tick on), calibration, felt weight or machine: what the arm would then have done
differently is not simulated, and its motors are taken to follow what they are told this time. Recordings before
version 3 do not hold what control was given.
"""


STREAMS = f"""\
## `{TOPICS}…`: streams of other devices

One channel a stream of Lab Streaming Layer ([lsl.md](../howto/lsl.md)), named after it; their number stands when the file
begins. A message holds the samples of about a tenth of a second. Encoding `cdr`, with sequences: a length of four
bytes, then the entries, each value aligned to its own size, counted from the end of the four bytes at the beginning.
`values` has the stream's own type, `float32`, `float64` (LSL's `double64`), `int8`, `int16`, `int32`, `int64` or
`string`:

```
{DEFINITION.format(type="float32")}```

Stamps and values are never altered: what LSL knows of the clock is in `/correction`, and `Recording.streams` has stamps
on the robot's clock (`t`) and on the computer's (`monotonic`) in columns beside. Log times of these channels, of
`/stream` and of `/correction` are when they came, on the rig's clock; without a robot, on CLOCK_MONOTONIC.
"""


def format_document() -> str:
    """The whole document, as Markdown."""
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
            remarks.append(f"since version {field.since}; before, and where nobody says, {field.default:g}")
        if field.narrow_before > 1:
            remarks.append(f"float32 before version {field.narrow_before}")
        meaning = field.meaning + (f" ({', '.join(remarks)})" if remarks else "")
        rows.append(f"| `{prefix}{field.name}` | {field.type}{size} | {field.unit} | {meaning} |")
        rows += _rows(field.fields, f"{prefix}{field.name}{size}.")
    return rows


if __name__ == "__main__":
    print(format_document(), end="")
