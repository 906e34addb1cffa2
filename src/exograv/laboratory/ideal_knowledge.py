"""Controller knowledge taken from the twin's truth: the upper bound of any identification.

Only the transparency test and the virtual study may use it, as a reference beside the identified arm. Nothing of
control or identification may import it; tests/laboratory/test_transparency.py checks that.
"""

from dataclasses import replace

import numpy as np

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import V_REST
from exograv.model.assembly import Assembly
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Machine, parameter_truth
from exograv.rig.twin.twin import WARM_UP_TIME
from exograv.rig.twin.world.link_truth import link_truth

from .virtual_laboratory import VirtualLaboratory


def ideal_knowledge(laboratory: VirtualLaboratory, t: float) -> ControllerKnowledge:
    """Return machine, cuffs, arm and friction as they truly are at time `t` on the rig's clock [s].

    Still unknown are the encoders' offsets, noise and delay, the curvature of the shoulder's path, and friction beyond
    the controller's law.
    """
    machine = _true_machine(laboratory, t)
    assembly = _true_cuffs(laboratory)
    return ControllerKnowledge(assembly, machine, _true_parameters(laboratory, assembly, machine), t)


def _true_machine(laboratory: VirtualLaboratory, t: float) -> CalibratedMachine:
    truth, description = laboratory.machine, laboratory.description
    friction, nothing = _friction_at(truth, t), np.zeros(len(description.joints))
    certain = Friction(nothing, nothing, nothing, nothing, nothing, friction.v_stribeck, V_REST)
    return CalibratedMachine(
        actuators=ActuatorGain(truth.drives.gain, nothing),
        friction=friction,
        friction_sd=certain,
        phi=link_truth(description, truth, laboratory.wearer.lengths_given),
        gravity=truth.gravity,
        rotor_inertia=truth.drives.rotor_inertia,
        residual_sd=nothing,
        correlation_s=nothing,
    )


def _friction_at(truth: Machine, t: float) -> Friction:
    friction = truth.friction
    warm = 1.0 - friction.warm_up * (1.0 - np.exp(-t / WARM_UP_TIME))
    return Friction(
        coulomb=warm * friction.coulomb,
        viscous=warm * friction.viscous,
        breakaway=friction.breakaway,
        load_share=friction.load_share,
        asymmetry=warm * friction.coulomb * friction.asymmetry,
        v_stribeck=friction.stribeck_velocity,
        v_rest=V_REST,
    )


def _true_cuffs(laboratory: VirtualLaboratory) -> Assembly:
    assembly, stiffness = laboratory.assembly(), laboratory.wearer.cuffs.stiffness
    across, along = 1e-3 * stiffness[0], 1e-3 * stiffness[2]
    about_others, about_limb = np.deg2rad(stiffness[3]), np.deg2rad(stiffness[5])
    true = {
        "along_N_per_mm": along,
        "across_N_per_mm": across,
        "about_limb_Nm_per_deg": about_limb,
        "about_others_Nm_per_deg": about_others,
    }

    def as_worn(cuff):
        # A direction that the machine leaves free is also free on the wearer.
        return cuff.model_copy(update={name: value for name, value in true.items() if getattr(cuff, name) > 0.0})

    return replace(assembly, cuffs=tuple(as_worn(cuff) for cuff in assembly.cuffs))


def _true_parameters(
    laboratory: VirtualLaboratory, assembly: Assembly, machine: CalibratedMachine
) -> parameters.Parameters:
    wearer, layout = laboratory.wearer, parameters.ParameterLayout.of(assembly)
    truth = parameter_truth(wearer)
    for limb, arm in zip(assembly.arm.limbs, wearer.arms, strict=True):
        longer = arm.skeleton.lengths["upper_arm"] - assembly.arm.lengths["upper_arm"]
        truth[f"{limb.prefix}upper_arm_lengthening"] = longer
    x = np.array([truth.get(name, 0.0) for name, _ in parameters.names_and_units(assembly)])
    x[layout.rotor] = machine.rotor_inertia
    x[layout.coulomb], x[layout.viscous] = machine.friction.coulomb, machine.friction.viscous
    return x
