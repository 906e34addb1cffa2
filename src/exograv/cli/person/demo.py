"""`exograv demo` and `exograv identify`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from exograv.cli.shell.base_options import Common, refuse_unwritable
from exograv.procedures.identification.method_names import MethodName, MotionName


@dataclass(frozen=True)
class Demo(Common):
    """Identify a virtual arm in a virtual machine, float it, find a known weight, write a report."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    method: MethodName = "recursive"
    """How the arm is identified: ours, the paper's, or the table alone."""

    gravity_level: float = 0.0
    """Felt share of the arm's own weight: 0 weightless, 0.165 Moon, 0.378 Mars, 1 Earth."""

    seconds: float = 60.0
    """Motion that the arm is identified from [s]."""

    motion: MotionName = "designed"
    """What moves the arm meanwhile: the machine's own motion, pieces planned from what is uncertain, or others'."""

    torque_source: Literal["current", "commanded"] = "current"
    """What counts as real torque: motor current, or what was commanded."""

    realtime: bool = False
    """Show it at the pace of life."""

    wearer_model: str | None = None
    """MJCF or URDF of a third party's arm that is the truth in place of a drawn one; needs `--wearer-map`."""

    wearer_map: str | None = None
    """TOML file that says what the model's bodies and joints are (docs/wearer_models.md)."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the machine is calibrated first."""

    keep: Path | None = None
    """Keep the person as identified in this file, for the next donning."""

    code: str | None = None
    """Code that stands for the person in that file, such as P-07, never a name; a random one if none is given."""

    participant: Path | None = None
    """File of an earlier donning (`--keep`) to start from."""

    donning: int = 0
    """Day on which the twin's wearer is in the machine: 0 the first, 1 the same person in the cuffs anew."""


@dataclass(frozen=True)
class Identify(Demo):
    """Calibrate the empty machine and identify the arm, nothing more."""


def run_demo_command(command: Demo) -> dict[str, Any]:
    """Run it and show the closing table."""
    from exograv.cli.shell.terminal import bars, show_demo
    from exograv.laboratory.demo import DemoOptions, run_demo
    from exograv.procedures.identification.participant_session import ParticipantOptions

    if command.keep is not None:
        refuse_unwritable(command.keep, "--keep")
    files = ParticipantOptions(command.keep, command.code, command.participant)
    options = DemoOptions(
        command.rig,
        command.side,
        command.level,
        command.method,
        command.gravity_level,
        command.seed,
        command.seconds,
        command.torque_source,
        command.realtime,
        only_identify=isinstance(command, Identify),
        wearer_model=command.wearer_model,
        wearer_map=command.wearer_map,
        calibration=command.calibration,
        donning=command.donning,
        files=files,
        motion=command.motion,
    )
    with bars() as progress:
        result = run_demo(options, command.out, progress)
    show_demo(result)
    return result
