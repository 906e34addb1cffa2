"""Command `exograv rig export`."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.procedures.machine_tools.options import ExportOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.export_urdf import ExportedMachine


def run_export_command(options: ExportOptions, common: OutFolder) -> "ExportedMachine":
    """Write the machine and arm of a participant as URDF, their kinematic loops as TOML, and both together as MJCF."""
    from rich.console import Console

    from exograv.procedures.machine_tools.export_urdf import run_export

    result = run_export(options, common.out)
    console = Console()
    masses = ", ".join(f"{name.replace('_', ' ')} {mass:.2f} kg" for name, mass in result.segment_mass_kg.items())
    for line in (f"Arm of {result.code}: {masses}.", f"Links of the machine: {result.links}.", *result.notes):
        console.print(line, highlight=False)
    for name in result.files:
        console.print(str(result.folder / name), highlight=False, soft_wrap=True)
    return result
