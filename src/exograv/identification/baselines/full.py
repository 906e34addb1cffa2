"""Full: mass and centre of mass of each rigid body from force/torque sensors at the cuffs, in two resting postures.

It has eight parameters: mass and three first moments of upper arm and forearm. Each posture gives one equilibrium per
freedom of the arm (`rest_statics`). The model has no passive torque. All cuff torque counts as weight, so that the
elasticity of relaxed joints biases the masses. Shoulders are aligned, and the cuffs do not sag.

These points are our choices, because we could not read the full source. *Poses*: the two postures of the task workspace
with the smallest expected weight error elsewhere (`rest_choice`). *Solution*: the smallest change of the table, in
units of its spread, that explains both rests. At rest only sums of masses and first moments are observable; their split
stays as near to the table as possible. No noise is assumed, because no text that we could read mentions any. *Other
arms*: three bodies and twelve parameters with a wrist, twice as many with two arms.

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
"""Share of the largest torque variance below which a combination is not observable [-]; rounding is 1e-16."""


def full(assembly: Assembly, machine: CalibratedMachine) -> RestingCorrection:
    """Build the method for this arm in this machine."""
    statics = RestStatics(assembly, machine)
    spread = gravity_spread(statics)

    def gain_of(Y: Float[np.ndarray, "row phi"]) -> Gain:
        return spread @ Y.T @ np.linalg.pinv(Y @ spread @ Y.T, rcond=UNSEEN, hermitian=True)

    return RestingCorrection("full", statics, gain_of, measured_body, RESTS)
