"""Structure of the torque of a wearer who repeats touches: what an estimator may assume about working muscles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Phases = Float[np.ndarray, " sample"]

PHASE_LENGTH = 0.06
"""Correlation length of the repeated torque over the phase of a touch [-]: 0.17 s of 2.75 s. Assumed."""

FAST_S, SLOW_S = 0.3, 3.0
"""Correlation times of torque that differs from touch to touch [s]: motor noise with corrections, and a slow bias.
Both parts have the same variance (assumed)."""

FREE_NM = 100.0
"""Standard deviation of a torque about which nothing is assumed [N·m]: more than the strength of an arm."""


@dataclass(frozen=True)
class MuscleTorque:
    """Assumed standard deviations of the parts of the muscle torque, at each of the machine's joints [N·m]."""

    repeated_Nm: float = FREE_NM
    """Part that is the same function of the phase at every touch. It is free by default, because the wearer carries
    what the machine leaves of the weight at every touch."""

    answer_Nm: float = FREE_NM
    """Further part that is the same at every touch under one condition, such as a level of the machine's support. It is
    free by default, because muscles take over what the machine gives up."""


def touch_phase(t: Phases, touches: Sequence[float], usual_s: float) -> Phases:
    """Phase of each sample between two touches [-], from 0 at a touch to 1 at the next one.

    Before the first touch and after the last one, the phase runs at the usual pace.

    Args:
        t: Time of each sample [s].
        touches: Times of the touches of this window, in order [s].
        usual_s: Usual time from touch to touch [s].
    """
    if not touches:
        return np.zeros_like(t)
    at = np.array([touches[0] - usual_s, *touches, touches[-1] + usual_s])
    return np.interp(t, at, np.arange(len(at), dtype=float)) % 1.0


def repeated_correlation(phase: Phases) -> Float[np.ndarray, "sample sample"]:
    """Correlation of the repeated torque between phases: a smooth periodic function."""
    apart = np.abs(phase[:, None] - phase)
    return np.exp(-0.5 * (np.minimum(apart, 1.0 - apart) / PHASE_LENGTH) ** 2)


def varying_correlation(phase: Phases, usual_s: float) -> Float[np.ndarray, "sample sample"]:
    """Correlation between phases of the torque that differs from touch to touch."""
    apart_s = usual_s * np.abs(phase[:, None] - phase)
    return 0.5 * np.exp(-apart_s / FAST_S) + 0.5 * np.exp(-apart_s / SLOW_S)
