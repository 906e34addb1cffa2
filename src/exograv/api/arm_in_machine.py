"""Model of a person's arm in a machine: input of every function of the public API that computes a torque."""

from dataclasses import replace
from pathlib import Path

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import COULOMB, VISCOUS, Calibration
from exograv.identification.calibration.empty_prior import usual_friction
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.storage.calibration_file import identity_of, read_calibration, refuse_other_machine


def arm_in_machine(
    rig: RigDescription, person: Body, calibration: Calibration | None
) -> tuple[Assembly, CalibratedMachine]:
    """Assemble machine and arm.

    A machine without calibration has the torque constants and rotors of its data sheets, and the usual friction of such
    drives with its spread between machines. The error of an uncalibrated torque constant stays outside every interval.

    Raises:
        ModelError: The machine does not fit the person, or its cuffs leave a freedom of the arm unsupported.
    """
    assembly = assemble(rig, person)
    machine = _uncalibrated(rig, assembly) if calibration is None else calibration.machine
    return assembly, machine


def load_calibration(path: str | Path, rig: RigDescription) -> Calibration:
    """Read the calibration of a machine, as `exograv rig calibrate` wrote it.

    Args:
        path: File to read.
        rig: Machine that the file must belong to.

    Raises:
        ConfigError: The file cannot be read, is damaged, or belongs to another machine.
    """
    stored = read_calibration(Path(path))
    refuse_other_machine(
        Path(path), stored.identity, identity_of(rig, stored.identity.machine), "Give the file of this machine."
    )
    return stored.calibration()


def _uncalibrated(rig: RigDescription, assembly: Assembly) -> CalibratedMachine:
    machine = nominal_machine(rig, assembly.exo.phi)
    spread = {name: usual_friction(rig, table)[1] for name, table in (("coulomb", COULOMB), ("viscous", VISCOUS))}
    return replace(machine, friction_sd=replace(machine.friction_sd, **spread))
