"""Model of a person's arm in a machine: input of every function of the public API that computes a torque."""

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import Calibration
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine


def arm_in_machine(
    rig: RigDescription, person: Body, calibration: Calibration | None
) -> tuple[Assembly, CalibratedMachine]:
    """Assemble machine and arm; a machine without calibration has the values of its data sheets.

    Raises:
        ModelError: The machine does not fit the person, or its cuffs leave a freedom of the arm unsupported.
    """
    assembly = assemble(rig, person)
    machine = nominal_machine(rig, assembly.exo.phi) if calibration is None else calibration.machine
    return assembly, machine
