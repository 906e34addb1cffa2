"""Command `exograv report`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.errors import RecordingError


@dataclass(frozen=True)
class Report:
    """Options of `exograv report`."""

    recording: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recording of a run (.mcap)."""


def run_report(command: Report, common: OutFolder) -> dict[str, Any]:
    """Write the report of a recording again."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.report.of_recording.recording_report import write_report

    if command.recording.is_dir():
        there = ", ".join(sorted(path.name for path in command.recording.glob("*.mcap"))[:5]) or "none"
        raise RecordingError(f"{command.recording} is a folder. Give one recording; recordings there: {there}.")
    if not command.recording.is_file():
        raise RecordingError(f"No recording '{command.recording}'. Give the .mcap file that a run has written.")
    with bars(FIRST_LINE_S) as progress:
        progress(f"Reading {command.recording.name} and drawing its figures", 0.0)
        report = write_report(command.recording, common.out / "report.html")
    print(f"Report: {report}")
    return {"recording": str(command.recording), "report": str(report)}
