"""Identification setting of an arm in a calibrated machine."""

import numpy as np

from exograv.dynamics.parameters import ParameterLayout

from .arm_model import ArmModel
from .discrepancy import Discrepancy
from .interface import Covariance, Parameters
from .noise import Noise
from .prior import disturbance_sd
from .setting import Setting, Springs


def arm_setting(model: ArmModel, mean: Parameters, covariance: Covariance, discrepancy: Discrepancy) -> Setting:
    """Build the setting that every method starts from, with this prior; the method takes ownership of `model`."""
    assembly, machine, layout = model.assembly, model.machine, ParameterLayout.of(model.assembly)
    of_machine = np.zeros(len(mean), dtype=bool)
    of_machine[layout.rotor.start : layout.viscous.stop] = True
    return Setting(
        model=model,
        mean=mean,
        covariance=covariance,
        noise=Noise(machine.residual_sd, machine.correlation_s, disturbance_sd(assembly.description.places)),
        bodies=layout.bodies,
        learned=np.ones(len(mean), dtype=bool),
        machine=of_machine,
        discrepancy=discrepancy,
        springs=Springs(layout.stiffness, layout.spring_offset, lambda: model.z),
        again=model.again,
    )
