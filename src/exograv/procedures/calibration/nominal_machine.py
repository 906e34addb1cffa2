"""Nominal machine by its data sheets, as if a calibration had confirmed them: for planning, never for a wearer."""

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import V_REST
from exograv.identification.calibration.empty_prior import COULOMB, V_STRIBECK, VISCOUS, usual_friction
from exograv.model.description import RigDescription


def nominal_machine(description: RigDescription, phi: np.ndarray) -> CalibratedMachine:
    """Machine with gains and rotors of `rig.toml`, usual friction of the drives, and links (joint, 10) as drawn."""
    coulomb, viscous = (usual_friction(description, table)[0] for table in (COULOMB, VISCOUS))
    ones, zeros = np.ones(len(coulomb)), np.zeros(len(coulomb))
    v_stribeck = np.full(len(coulomb), V_STRIBECK)
    return CalibratedMachine(
        actuators=ActuatorGain(description.nominal_gain, 0.005 * description.nominal_gain),
        friction=Friction(coulomb, viscous, ones, zeros, zeros, v_stribeck, V_REST),
        friction_sd=Friction(0.02 * coulomb, 0.05 * viscous, zeros, zeros, zeros, v_stribeck, V_REST),
        phi=phi,
        gravity=GRAVITY,
        rotor_inertia=description.per_actuator("rotor_inertia_kgm2"),
        residual_sd=zeros,
        correlation_s=zeros,
    )
