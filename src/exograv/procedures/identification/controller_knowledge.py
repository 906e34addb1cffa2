"""What the controller of a worn machine knows of arm and machine."""

from dataclasses import dataclass

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.calibration.empty_machine import Calibration
from exograv.model.assembly import Assembly

MOTION_S = 60.0  # as in `exograv demo`


@dataclass(frozen=True)
class ControllerKnowledge:
    """What the controller of a worn machine knows."""

    assembly: Assembly
    machine: CalibratedMachine
    x: Parameters
    """The arm as identified, or as the table has it, and the friction."""

    t: float
    """The rig's clock when all was done: the machine has warmed up so far [s]."""

    calibration: Calibration | None = None
    """Of the empty machine, where it was measured."""
