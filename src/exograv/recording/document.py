"""docs/recording_format.md, made from the table. `python -m exograv.recording.document` prints it."""

from .encoding import tick_definition
from .schema import CHANNELS, SCHEMA_VERSION, Channel, Field

INTRODUCTION = f"""\
# Recording format

Made from the table in `src/exograv/recording/schema.py`; a test fails when the two differ. To renew it:
`python -m exograv.recording.document > docs/recording_format.md`

A recording is one [MCAP](https://mcap.dev) file, version {SCHEMA_VERSION} of this format (`schema_version` in
`/settings`). It is written while the run goes on, in chunks of about 1 MB (zstd): what is killed loses at most its last
chunk, and the reader says so. It holds no wall-clock time. Log times are the rig's clock in nanoseconds, so the same
seed gives the same messages, but for `tick_us`.

Values are SI unless the unit beside them says otherwise. `[joint]` is one entry per actuated joint, in the order of
`joints` in `/settings`. Torque is positive along the joint's axis, and is what the motor adds. Each channel carries
its own schema in the file, so that a viewer that knows nothing of exograv can open it.
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
    return "\n".join([INTRODUCTION, *(_section(channel) for channel in CHANNELS.values()), binary])


def _section(channel: Channel) -> str:
    head = f"## `{channel.topic}`\n\n{channel.meaning} Encoding `{channel.encoding}`, {channel.rate}.\n"
    rows = ["| field | type | unit | meaning |", "|---|---|---|---|", *_rows(channel.fields)]
    return "\n".join([head, *rows, ""])


def _rows(fields: tuple[Field, ...], prefix: str = "") -> list[str]:
    rows = []
    for field in fields:
        size = "".join(f"[{'' if length == 'any' else length}]" for length in field.size)
        remarks = [
            word for word, holds in (("may be absent", field.optional), ("may be null", field.nullable)) if holds
        ]
        meaning = field.meaning + (f" ({', '.join(remarks)})" if remarks else "")
        rows.append(f"| `{prefix}{field.name}` | {field.type}{size} | {field.unit} | {meaning} |")
        rows += _rows(field.fields, f"{prefix}{field.name}{size}.")
    return rows


if __name__ == "__main__":
    print(format_document(), end="")
