"""`exograv export-urdf`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class ExportUrdf(Common):
    """Write a participant's machine and arm as URDF, their loops as TOML, and both together as MJCF."""

    participant: Annotated[Path, tyro.conf.arg()] = Path("participant.toml")
    """File that `exograv identify --keep` has written."""

    calibration: Path | None = None
    """calibration.toml of the machine, for its links; without it they are those of its description."""

    rig: str | None = None
    """Folder of the machine, if it is not a built-in one."""


def run_export_command(command: ExportUrdf) -> dict[str, Any]:
    """Write the files into the folder of `--out` and say what they are."""
    from rich.console import Console

    from exograv.procedures.machine_tools.export_urdf import ExportOptions, run_export

    result = run_export(ExportOptions(command.participant, command.out, command.calibration, command.rig))
    console = Console()
    masses = ", ".join(f"{name.replace('_', ' ')} {mass:.2f} kg" for name, mass in result["segment_mass_kg"].items())
    for line in (f"Arm of {result['code']}: {masses}.", f"Links of the machine: {result['links']}.", *result["notes"]):
        console.print(line, highlight=False)
    for name in result["files"]:
        console.print(str(Path(result["folder"]) / name), highlight=False, soft_wrap=True)
    return result
