"""Identification setting of an arm in a calibrated machine."""

from typing import cast

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.loops import FIT

from .arm_model import ArmModel
from .discrepancy import Discrepancy
from .hidden_cuffs import Cuffs
from .interface import Covariance, Joints, Parameters, TorqueModel
from .noise import Noise
from .path_discrepancy import PathDiscrepancy
from .prior import disturbance_sd, usual_springs
from .setting import Setting
from .tissue import Shoulder, Springs


def arm_setting(model: ArmModel, mean: Parameters, covariance: Covariance, discrepancy: Discrepancy) -> Setting:
    """Build the setting that every method starts from, with this prior; the method takes ownership of `model`."""
    assembly, machine, layout = model.assembly, model.machine, ParameterLayout.of(model.assembly)
    of_machine = np.zeros(len(mean), dtype=bool)
    of_machine[layout.rotor.start : layout.viscous.stop] = True
    shoulders = tuple(
        Shoulder(
            slice(limb.freedoms.start, limb.freedoms.start + 4),
            slice(layout.fit.start + limb.number * len(FIT), layout.fit.start + limb.number * len(FIT) + 3),
        )
        for limb in assembly.arm.limbs
    )
    stiffness, neutral = usual_springs(assembly.arm)
    return Setting(
        model=model,
        mean=mean,
        covariance=covariance,
        noise=Noise(machine.residual_sd, machine.correlation_s, disturbance_sd(assembly.description.places)),
        bodies=layout.bodies,
        learned=np.ones(len(mean), dtype=bool),
        machine=of_machine,
        discrepancy=discrepancy,
        path=PathDiscrepancy([shoulder.offset for shoulder in shoulders], assembly.n),
        springs=Springs(layout.stiffness, layout.spring_offset, _angles, stiffness, neutral, shoulders, _end_stops),
        cuffs=Cuffs(len(assembly.cuffs), lambda model: cast(ArmModel, model).cuff_loads()),
        again=model.again,
    )


def _angles(model: TorqueModel) -> Float[np.ndarray, " freedom"]:
    """Arm angles of the sample that an arm's model linearised last [rad]."""
    return cast(ArmModel, model).z


def _end_stops(model: TorqueModel) -> Joints:
    """Uncertain torque of the end stops in the sample that an arm's model linearised last (joint,) [N·m]."""
    return cast(ArmModel, model).end_stop_uncertainty()
