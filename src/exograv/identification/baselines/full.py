"""Full: mass and centre of mass of each rigid body from force/torque sensors at the cuffs, in two resting postures.

Eight parameters: mass and three first moments of upper arm and forearm. Each posture gives one equilibrium per freedom
of the arm (`rest_statics`), in which cuff torque is taken for weight alone: there are no passive torques in this model,
so the elasticity of relaxed joints goes into the masses. Aligned shoulders, no sag of the cuffs.

Choices where the source could not be read. *Poses*: the two of the task workspace after which the weight is expected to
err least elsewhere (`rest_choice`). *Solution*: the least change of the table, in units of its spread, that explains
both rests; at rest only sums of masses and first moments show, and their split stays as near to the table as they
allow. No noise is assumed, as nothing says that the method has any. *Other arms*: with a wrist three bodies and twelve
parameters, two arms twice as many.

Source: the method *Full* of Just et al. 2020, J NeuroEng Rehabil 17:13, doi 10.1186/s12984-020-0644-3, table 1 and
abstract.
"""

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.model.assembly import Assembly

from .rest_choice import Gain, gravity_spread
from .rest_statics import RestStatics
from .resting_correction import RestingCorrection, measured_body

RESTS = 2

UNSEEN = 1e-9
"""Share of the largest variance of torque below which a combination does not show: rounding is 1e-16 [-]."""


def full(assembly: Assembly, machine: CalibratedMachine) -> RestingCorrection:
    """The method for this arm in this machine."""
    statics = RestStatics(assembly, machine)
    spread = gravity_spread(statics)

    def gain_of(Y: Float[np.ndarray, "row phi"]) -> Gain:
        return spread @ Y.T @ np.linalg.pinv(Y @ spread @ Y.T, rcond=UNSEEN, hermitian=True)

    return RestingCorrection("full", statics, gain_of, measured_body, RESTS)
