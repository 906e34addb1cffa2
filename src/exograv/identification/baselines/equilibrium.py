"""Equilibrium: the table's weight of each segment, scaled until forces and torques balance in one resting posture.

It has two parameters: a factor for the upper arm and one for forearm with hand. The centres of mass stay the table's.
Each freedom of the arm gives one equilibrium (`rest_statics`), and the factors are the least-squares solution of all.
Passive torque that looks like weight in the resting posture enters the factors, and with them all other postures.
Shoulders are aligned, and the cuffs do not sag.

These points are our choices, because we could not read the full source. *Scaled quantities*: a force and a torque
equilibrium at each cuff would also allow another pair of numbers; we scale the segments' weights, with which "the
compensation scales". *Pose*: the posture of the task workspace with the smallest expected weight error elsewhere
(`rest_choice`). *Other arms*: one factor per segment.

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
    """Return the method for this arm in this machine."""
    segments = _columns(assembly)

    def gain_of(Y: Float[np.ndarray, "row phi"]) -> Gain:
        return segments @ np.linalg.pinv(Y @ segments)

    return RestingCorrection("equilibrium", RestStatics(assembly, machine), gain_of, scaled_body, RESTS)


def _columns(assembly: Assembly) -> Float[np.ndarray, "phi segment"]:
    """Matrix with one column per segment: the table's inertial parameters of this segment, zero for the others."""
    bodies, phi = ParameterLayout.of(assembly).bodies, assembly.arm.phi
    columns = np.zeros((len(phi), len(bodies)))
    for i, body in enumerate(bodies):
        columns[body, i] = phi[body]
    return columns
