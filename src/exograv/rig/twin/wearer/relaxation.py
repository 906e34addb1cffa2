"""Relaxation of the unseen world's tissue: a continuous spectrum of times over decades, as a few modes.

    G(t) ∝ ∫ τ^(−α−1) exp(−t/τ) dτ   from the shortest to the longest time

With α = 0 this is Fung's box spectrum; with α > 0 it falls as the power t^(−α) of a spring-pot between both times.

Source: Fung (1993), Biomechanics: Mechanical Properties of Living Tissues (form as in the manual of FEBio, module
relaxation-Fung); relaxation of stretched muscle as a spring-pot: Kobayashi & Matsuyama (2024), arXiv 2401.13217.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exograv.rig.twin.disturbances.streams import stream

MODES = 6
"""Number of modes: less than one decade apart, so that their sum follows the spectrum within 2 %."""


class RelaxationMode(NamedTuple):
    """Part of the elasticity that relaxes exponentially."""

    share: float
    """Share of all that relaxes [-]."""

    time: float
    """Time constant [s]."""


@dataclass(frozen=True)
class RelaxationSpectrum:
    """Spectrum of relaxation times of one person."""

    shortest: float
    """Shortest time of the spectrum [s]."""

    longest: float
    """Longest time of the spectrum [s]."""

    exponent: float
    """Exponent α [-]."""

    @cached_property
    def modes(self) -> tuple[RelaxationMode, ...]:
        """Modes of equal width on the axis of log τ, each at the middle of its part."""
        ends = np.geomspace(self.shortest, self.longest, MODES + 1)
        shares = np.diff(np.log(ends)) if self.exponent == 0.0 else -np.diff(ends**-self.exponent) / self.exponent
        shares = shares / shares.sum()
        times = np.sqrt(ends[:-1] * ends[1:])
        return tuple(RelaxationMode(*mode) for mode in zip(shares.tolist(), times.tolist(), strict=True))


def draw_relaxation(seed: int) -> RelaxationSpectrum:
    """Draw the spectrum of one person. The draw does not depend on the level; the ranges are assumed."""
    generator = stream(seed, "wearer", "world unseen relaxation")
    return RelaxationSpectrum(
        shortest=float(np.exp(generator.uniform(np.log(0.05), np.log(0.5)))),
        longest=float(np.exp(generator.uniform(np.log(50.0), np.log(500.0)))),
        exponent=float(generator.uniform(0.0, 0.35)),
    )
