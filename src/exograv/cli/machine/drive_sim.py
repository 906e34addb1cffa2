"""`exograv drive-sim`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class DriveSim(Common):
    """Simulated drives on a bus, with the twin behind them: a machine to try drivers and a bring-up on."""

    bus: tyro.conf.Positional[Literal["canopen", "moteus", "udp"]] = "udp"
    """On which they are reached."""

    drives: Path | None = None
    """drives.toml of the machine, with this bus; without, one is written into the folder drive_sim of --out."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 0
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    worn: bool = False
    """With its wearer, in the posture in which it is put on; without, it hangs empty."""

    lock_step: bool = False
    """Step by one period of the loop with each measurement, faster or slower than real time."""

    wrong_sign: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")] = ()
    """Joints whose motor turns the other way."""

    wrong_scale: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT:FACTOR")] = ()
    """Joints whose motor gives so many times the torque."""

    wrong_encoder: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")] = ()
    """Joints whose encoder counts the other way."""


def run_drive_sim_command(command: DriveSim) -> dict[str, Any]:
    """Serve until it is told to end."""
    from exograv.laboratory.drive_sim import DriveSimOptions, run_drive_sim

    options = DriveSimOptions(
        bus=command.bus,
        rig=command.rig,
        side=command.side,
        drives=command.drives,
        folder=command.out,
        level=command.level,
        seed=command.seed,
        worn=command.worn,
        lock_step=command.lock_step,
        wrong_sign=command.wrong_sign,
        wrong_scale=command.wrong_scale,
        wrong_encoder=command.wrong_encoder,
    )
    try:
        run_drive_sim(options, lambda line: print(line, flush=True))
    except KeyboardInterrupt:
        print("Ended by the keyboard.", flush=True)
    return {"bus": command.bus, "rig": command.rig}
