"""What yesterday's identification still says about the same person today, after the cuffs were fastened anew."""

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout

Parameters = Float[np.ndarray, " parameter"]
Covariance = Float[np.ndarray, "parameter parameter"]
Kept = Float[np.ndarray, " kept"]

# Share of the table's variance that is new on another day. No source measures all of this on one arm, so all are
# assumed. The arm: a day moves body mass by about 1 %, and a sleeve weighs as much again: 2 % of a segment's mass,
# where the table knows it within 10-15 %. Its elasticity: 10 % of stiffness, 4° of neutral angle, against 65 % and 25°.
ARM_NEW = 0.03
FIT_NEW = np.array([1.0, 1.0, 1.0, 0.2, 0.05, 0.25, 0.25])
"""Of `model.loops.FIT`: the shoulder sits elsewhere; its path is the person's, and the trunk's; the length was told
once; straps are pulled about as tight as before: 20 % of stiffness, against 40 % between people."""

FORGETTING_DAYS = 90.0
"""Beyond the day-to-day share: an arm gains and loses muscle. The table's spread is back after some such times."""


def kept_part(layout: ParameterLayout) -> slice:
    """Of all that is learned, what is the person's; rotors and friction are the machine's and calibrated anew."""
    return slice(0, layout.fit.stop)


def carried_over(
    layout: ParameterLayout,
    yesterday: tuple[Kept, Float[np.ndarray, "kept kept"]],
    table: tuple[Parameters, Covariance],
    days: float,
) -> tuple[Parameters, Covariance]:
    """What to believe before today's motion.

    Each parameter keeps a share ρ of its distance from the table and takes fresh variance in place of what it loses:

        x_today = m + ρ (x_yesterday − m) + sqrt(1 − ρ²) · (as uncertain as the table)

    so that a belief as wide as the table's stays as wide, and none is ever wider.

    Args:
        layout: Of the parameters.
        yesterday: Mean and covariance of `kept_part`, after the last identification.
        table: Mean m and covariance of everything before any motion, in the machine as calibrated today.
        days: Since the last identification [days].
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
