"""Command `exograv data sync` and the table of its result."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.results import MERGED

if TYPE_CHECKING:
    from exograv.study.sync import StreamSync, SyncResult


@dataclass(frozen=True)
class Sync:
    """Options of `exograv data sync`."""

    file: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recording of `exograv run live --record-stream` or `exograv data streams --record` (.mcap)."""


@dataclass(frozen=True)
class SyncShown:
    """Result of `exograv data sync`."""

    found: "SyncResult" = field(metadata=MERGED)
    figure: Path


def run_sync(command: Sync, common: OutFolder) -> SyncShown:
    """Show how well the streams in a recording are synchronised with the robot's clock, and their missing samples."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.recording import open_recording
    from exograv.report.figures.sync import draw_streams
    from exograv.report.style.figure_style import mark_simulated, write_picture
    from exograv.study.sync import sync_figures

    with bars(FIRST_LINE_S) as progress:
        progress(f"Reading {command.file.name}", 0.0)
        recording = open_recording(command.file)
        progress("Comparing the clocks of the streams", 0.3)
        result = sync_figures(recording)
        picture = write_picture(
            common.out / "sync.png", lambda: mark_simulated(draw_streams(recording.streams), recording.is_simulated)
        )
        result = SyncShown(result, picture)
    show_sync(result)
    return result


def show_sync(shown: SyncShown) -> None:
    """Print a table of the streams, then the remarks about each stream."""
    from rich.console import Console
    from rich.table import Table

    console, result = Console(), shown.found
    if result.remark:
        console.print(result.remark, highlight=False)
    table = Table(title="Streams of other devices, on the robot's clock", title_justify="left")
    table.add_column("")
    for stream in result.streams:
        table.add_column(stream.name, justify="right")
    for label, cell in ROWS.items():
        table.add_row(label, *(cell(stream) for stream in result.streams))
    console.print(table)
    for stream in result.streams:
        for remark in stream.remarks:
            console.print(f"{stream.name}: {remark}", highlight=False)
    if robot := result.robot:
        scatter = robot.scatter_us
        console.print(
            f"Robot: {robot.ticks} ticks pair its clock with the computer's; their scatter about a straight line is "
            f"{scatter.p50:g} µs (median), {scatter.max:g} (max).",
            highlight=False,
        )
    console.print(f"Figure: {shown.figure}", highlight=False)


def _number(value: float | int | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _by_clock(name: str, digits: int, interval: str | None = None):
    """Return a function that formats a cell with one line per connection."""

    def cell(stream: "StreamSync") -> str:
        lines = list[str]()
        for clock in stream.clocks:
            ci95 = getattr(clock, interval) if interval else None
            half = f" ± {0.5 * (ci95[1] - ci95[0]):.{digits}f}" if ci95 else ""
            lines.append(_number(getattr(clock, name), digits) + half)
        return "\n".join(lines) or "–"

    return cell


ROWS: "dict[str, Callable[[StreamSync], str]]" = {
    "type": lambda stream: stream.type,
    "samples": lambda stream: str(stream.samples),
    "rate, Hz": lambda stream: _number(stream.effective_rate_Hz, 3),
    "nominal": lambda stream: f"{stream.nominal_rate_Hz:g}" if stream.nominal_rate_Hz else "irregular",
    "connections": lambda stream: str(stream.connections),
    "offset, ms": _by_clock("offset_ms", 3, "offset_ci95_ms"),
    "drift, ppm": _by_clock("drift_ppm", 2, "drift_ci95_ppm"),
    "corrections": _by_clock("measured", 0),
    "round trip, µs": _by_clock("round_trip_us", 0),
    "jitter of stamps, µs: sd": lambda stream: _number(None if stream.jitter_us is None else stream.jitter_us.sd, 1),
    "  99 %": lambda stream: _number(None if stream.jitter_us is None else stream.jitter_us.p99, 1),
    "gaps": lambda stream: str(stream.gaps_total),
    "delay of arrival, ms: median": lambda stream: _number(
        None if stream.arrival_ms is None else stream.arrival_ms.p50, 1
    ),
    "uncertainty of a stamp, ± µs": lambda stream: _number(stream.certain_to_us, 0),
}
