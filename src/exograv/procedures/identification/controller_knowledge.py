"""Knowledge that the controller of a worn machine has of arm and machine."""

from dataclasses import dataclass

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core.interface import Covariance
from exograv.model.assembly import Assembly

MOTION_S = 60.0  # as in `exograv demo`


@dataclass(frozen=True)
class ControllerKnowledge:
    """Model and parameters that the controller of a worn machine uses."""

    assembly: Assembly
    machine: CalibratedMachine
    x: Parameters
    """Arm parameters, as identified or by the table, and friction."""

    t: float
    """Time on the rig's clock after the identification [s]. The machine has warmed up for this long."""

    calibration: Calibration | None = None
    """Calibration of the empty machine, where it was measured."""

    covariance: Covariance | None = None
    """Covariance of `x`; None where the arm is the table's, or its method states no uncertainty."""
