"""Prior of a calibration from the machine's twin, in place of data sheets and drawings.

The twin's values hold for the day of its recordings. What may have changed since is added to their covariance: friction
by temperature and wear, gains by temperature, the zeros of the encoders, the base, and the weights on the scale.
"""

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_machine import CHANGE_SD
from .empty_prior import OFFSET_SD, TILT_SD, WEIGHT_SD, EmptyLayout, EmptyPrior, data_sheet_prior

AFRESH = ("ripple_sine", "ripple_cosine", "coulomb_warming", "viscous_warming")
"""Unknowns of a single run, which keep the prior of the data sheets."""

GAIN_CHANGE = 0.01
"""Standard deviation of the change of a gain since the recordings [-]: magnets weaken by 3 % when they get warm."""

ROTOR_CHANGE = 0.02
"""Standard deviation of the change of the rotor's inertia, as a share [-]. Assumed: it does not change, but gears and
couplings are exchanged."""

LOAD_SHARE_CHANGE, BREAKAWAY_CHANGE, LOG_V_CHANGE = 0.01, 0.1, 0.3
"""Standard deviations of the changes of load share, breakaway ratio and logarithm of the Stribeck speed [-].
Assumed."""

LINK_SHARE = 0.5
"""Standard deviation of a link's change, over that of a link against its drawing [-]: parts are exchanged. Assumed."""


def twin_prior(
    description: RigDescription,
    tree: Tree,
    layout: EmptyLayout,
    mean: Float[np.ndarray, " unknown"],
    covariance: Float[np.ndarray, "unknown unknown"],
) -> EmptyPrior:
    """Return the prior of a calibration.

    Args:
        description: The machine.
        tree: The machine at its lengths.
        layout: Order of the twin's unknowns; it may have more than a calibration.
        mean: Their mean.
        covariance: Their covariance.
    """
    sheets = data_sheet_prior(description, tree)
    own = sheets.layout
    shared = [name for name in own.per_joint if name in layout.per_joint and name not in AFRESH]
    here, there = (np.r_[*(one.of(name) for name in shared), one.tilt, one.weight, one.links] for one in (own, layout))
    value = sheets.mean.copy()
    value[here] = mean[there]
    spread = sheets.covariance.copy()
    spread[here, :] = spread[:, here] = 0.0
    spread[np.ix_(here, here)] = covariance[np.ix_(there, there)]
    coulomb = np.abs(value[own.of("coulomb")])
    changes = {
        "inverse_gain": GAIN_CHANGE * value[own.of("inverse_gain")],
        "coulomb": CHANGE_SD * coulomb,
        "viscous": CHANGE_SD * np.abs(value[own.of("viscous")]),
        "load_share": LOAD_SHARE_CHANGE,
        "asymmetry": CHANGE_SD * np.hypot(value[own.of("asymmetry")], 0.1 * coulomb),
        "rotor": ROTOR_CHANGE * value[own.of("rotor")],
        "breakaway": BREAKAWAY_CHANGE,
        "log_v_stribeck": LOG_V_CHANGE,
        "offset": OFFSET_SD,
    }
    added = np.zeros(len(value))
    for name, sd in changes.items():
        added[own.of(name)] = np.square(sd)
    added[own.tilt], added[own.weight] = TILT_SD**2, WEIGHT_SD**2
    spread += np.diag(added)
    spread[own.links, own.links] += LINK_SHARE**2 * sheets.covariance[own.links, own.links]
    return EmptyPrior(own, value, spread)
