"""`exograv identify-log`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common, numbers
from exograv.procedures.identification.method_names import MethodName


@dataclass(frozen=True)
class IdentifyLog(Common):
    """Identify a payload from recorded logs of a robot: the same methods on real motors."""

    log: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recorded with the payload: CSV with time [s], positions [rad], velocities [rad/s], currents [A]; no more."""

    unloaded: Path = field(default=tyro.MISSING)
    """The same robot without the payload."""

    urdf: Path = field(default=tyro.MISSING)
    """Description of the robot."""

    payload_frame: str = field(default=tyro.MISSING)
    """Link or frame that carries the payload."""

    gains: str = field(default=tyro.MISSING)
    """Joint torque per motor current [N·m/A], one a joint, separated by commas."""

    true_kg: float | None = None
    """The payload's mass, if it is known: then the time until the estimate stays within 10 % is reported."""

    method: MethodName = "recursive"
    """How the payload is identified."""

    rows: str | None = None
    """First and last row of the log to use, counted from 1, as a:b; without it the log is cut to the motion."""

    rows_unloaded: str | None = None
    """The same for the unloaded log."""

    gain_sd: float = 0.0
    """Standard deviation of the gains, as a share; widens the interval."""


def run_identify_log(command: IdentifyLog) -> dict[str, Any]:
    """Run it and show the payload."""
    from exograv.cli.shell.terminal import bars, show_payload
    from exograv.procedures.machine_tools.identify_log import identify_log

    with bars() as progress:
        result = identify_log(
            log=command.log,
            unloaded=command.unloaded,
            urdf=command.urdf,
            payload_frame=command.payload_frame,
            gains=numbers(command.gains, "--gains"),
            true_kg=command.true_kg,
            method=command.method,
            rows=command.rows,
            rows_unloaded=command.rows_unloaded,
            gain_sd=command.gain_sd,
            seed=command.seed,
            progress=progress,
        )
    show_payload(result)
    return result
