"""Command `exograv data streams`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.options import Acts
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.live.record_streams import RecordedStreams


@dataclass(frozen=True)
class Streams:
    """Options of `exograv data streams`."""

    record: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME")] = ()
    """Record the stream with this name, or all streams of this type. Can be repeated."""

    seconds: Annotated[float, tyro.conf.arg(metavar="S"), Acts(lambda all_: bool(all_.record), "with --record")] = 60.0
    """Duration of the recording [s]. Ctrl-C ends it earlier with a complete file."""


def run_streams(command: Streams, common: OutFolder) -> "RecordedStreams | dict[str, Any]":
    """List the visible streams of Lab Streaming Layer, or record some of them without a robot."""
    from exograv.cli.shell.terminal import bars

    if not command.record:
        return _look()
    from exograv.live.record_streams import record_streams

    with bars() as progress:
        result = record_streams(command.record, command.seconds, common.out / "streams.mcap", progress)
    for stream in result.streams:
        print(f"{stream.name} ({stream.type}): connected {stream.connected} times, lost {stream.lost}.")
    print(f"Recorded: {result.recording}. {result.recording_why}")
    return result


def _look() -> dict[str, Any]:
    from rich.console import Console
    from rich.table import Table

    from exograv.runtime.lsl.streams import visible

    found = visible()
    table = Table("name", "type", "host", "rate, Hz", "channels", "values", "source")
    for one in found:
        rate = f"{one.rate_Hz:g}" if one.rate_Hz else "irregular"
        table.add_row(one.name, one.type, one.host, rate, str(one.channels), one.value_type, one.source_id)
    if found:
        Console().print(table)
    else:
        print("No streams are visible. Start the programs of the devices; other computers must be in the same network.")
    return {"streams": json_value(found)}
