"""Prior from the previous session of the same person, after the cuffs were fastened again."""

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.loops import PATH_ENTRIES

Parameters = Float[np.ndarray, " parameter"]
Covariance = Float[np.ndarray, "parameter parameter"]
Kept = Float[np.ndarray, " kept"]

# Share of the table's variance that is new on another day. No source measures all of this on one arm, so all values
# are assumed. Arm: body mass changes by about 1 % per day, and a sleeve adds about 1 %; together 2 % of a segment's
# mass, against 10-15 % in the table. Elasticity: 10 % of stiffness and 4° of neutral angle, against 65 % and 25°.
ARM_NEW = 0.03
FURTHER = PATH_ENTRIES.stop - PATH_ENTRIES.start
"""Number of entries for the path of one shoulder's centre beside the usual one."""

FIT_NEW = np.array([1.0, 1.0, 1.0, 0.2, 0.05, 0.25, 0.25, 0.5, 0.1, 0.2, 0.2, *[0.2] * FURTHER])
"""New share of the variance of each entry of `model.loops.FIT`. The shoulder position is new. The path of the shoulder
centre belongs to the person and the trunk. The length was stated once. Straps are about as tight as before: 20 % of
stiffness, against 40 % between people. The elbow's axis belongs to the person; how far it is turned about the upper arm
also depends on how the arm lies in the cuffs."""

FORGETTING_DAYS = 90.0
"""Time constant of slow changes such as muscle mass [days], added to the day-to-day share. After several such times
the prior is as wide as the table's."""


def kept_part(layout: ParameterLayout) -> slice:
    """Slice of the parameters that belong to the person; rotors and friction belong to the machine."""
    return slice(0, layout.fit.stop)


def carried_over(
    layout: ParameterLayout,
    yesterday: tuple[Kept, Float[np.ndarray, "kept kept"]],
    table: tuple[Parameters, Covariance],
    days: float,
) -> tuple[Parameters, Covariance]:
    """Prior mean and covariance before today's motion.

    Each parameter keeps a share ρ of its distance from the table. New variance replaces the lost share:

        x_today = m + ρ (x_yesterday − m) + sqrt(1 − ρ²) · (as uncertain as the table)

    A prior as wide as the table's therefore stays as wide, and none becomes wider.

    Args:
        layout: Order of the parameters.
        yesterday: Mean and covariance of `kept_part`, after the last identification.
        table: Mean m and covariance of all parameters before any motion, in the machine as calibrated today.
        days: Time since the last identification [days].
    """
    kept = kept_part(layout)
    old = (1.0 - new_share(layout)) * np.exp(-max(days - 1.0, 0.0) / FORGETTING_DAYS)
    rho, fresh = np.sqrt(old), np.ones(len(table[0]))
    fresh[kept] = np.sqrt(1.0 - old)
    mean, covariance = table[0].copy(), fresh[:, None] * table[1] * fresh
    mean[kept] += rho * (yesterday[0] - mean[kept])
    covariance[kept, kept] += rho[:, None] * yesterday[1] * rho
    return mean, covariance


def new_share(layout: ParameterLayout) -> Kept:
    """Share of the table's variance that is new on the next day, per entry of `kept_part` [-]."""
    share = np.full(layout.fit.stop, ARM_NEW)
    share[layout.fit] = np.tile(FIT_NEW, layout.arms)
    return share
