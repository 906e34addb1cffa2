"""Equilibrium: the table's weight of each segment, scaled until forces and torques balance in one resting posture.

Two parameters: a factor for the upper arm and one for forearm with hand; the centres of mass stay the table's. Each
freedom of the arm gives one equilibrium (`rest_statics`), and the factors are the least squares of all. Passive torque
is contained as far as it looks like weight in that posture, and carried over to all others with it. Aligned shoulders,
no sag of the cuffs.

Choices where the source could not be read. *What is scaled*: a force and a torque equilibrium at each cuff would also
allow another pair of numbers; factors on the segments' weights are those with which "the compensation scales". *Pose*:
the one of the task workspace after which the weight is expected to err least elsewhere (`rest_choice`). *Other arms*:
one factor a segment.

Source: the method *Equilibrium* of Just et al. 2020, J NeuroEng Rehabil 17:13, doi 10.1186/s12984-020-0644-3, table 1
and abstract.
"""

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.model.assembly import Assembly

from .rest_choice import Gain
from .rest_statics import RestStatics
from .resting_correction import RestingCorrection, scaled_body

RESTS = 1


def equilibrium(assembly: Assembly, machine: CalibratedMachine) -> RestingCorrection:
    """The method for this arm in this machine."""
    segments = _columns(assembly)

    def gain_of(Y: Float[np.ndarray, "row phi"]) -> Gain:
        return segments @ np.linalg.pinv(Y @ segments)

    return RestingCorrection("equilibrium", RestStatics(assembly, machine), gain_of, scaled_body, RESTS)


def _columns(assembly: Assembly) -> Float[np.ndarray, "phi segment"]:
    """The table's body of each segment, alone."""
    bodies, phi = ParameterLayout.of(assembly).bodies, assembly.arm.phi
    columns = np.zeros((len(phi), len(bodies)))
    for i, body in enumerate(bodies):
        columns[body, i] = phi[body]
    return columns
