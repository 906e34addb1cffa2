"""`exograv drive-sim`."""

from typing import Any

from exograv.cli.shell.base_options import Common
from exograv.laboratory.options import DriveSimOptions


def run_drive_sim_command(options: DriveSimOptions, common: Common) -> dict[str, Any]:
    """Simulated drives on a bus, with the twin behind them: a machine to try drivers and a bring-up on."""
    from exograv.laboratory.drive_sim import run_drive_sim

    try:
        run_drive_sim(options, common.out, lambda line: print(line, flush=True))
    except KeyboardInterrupt:
        print("Ended by the keyboard.", flush=True)
    return {"bus": options.bus, "rig": options.rig}
