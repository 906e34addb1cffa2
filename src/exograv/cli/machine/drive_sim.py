"""Command `exograv dev drive-sim`."""

from typing import Any

from exograv.cli.shell.base_options import OutFolder
from exograv.laboratory.options import DriveSimOptions


def run_drive_sim_command(options: DriveSimOptions, common: OutFolder) -> dict[str, Any]:
    """Simulate drives on a bus with the twin behind them, to try drivers and a bring-up."""
    from exograv.laboratory.simulated_drives.drive_sim import run_drive_sim

    try:
        run_drive_sim(options, common.out, lambda line: print(line, flush=True))
    except KeyboardInterrupt:
        print("Ended by the keyboard.", flush=True)
    return {"bus": options.bus, "rig": options.rig}
