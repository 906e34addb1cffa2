"""Creep of the unseen world's rest posture: a power or the logarithm of time, or a late drift.

Each course is a share: 0 at the start, 1 after `CREEP_SPAN`.

Source: creep of a stretched joint is nearly straight on a logarithmic axis, Ryan et al. (2012), Scand J Med Sci Sports
22:179. A creep by a power of time is that of a spring-pot (`relaxation`). The late drift is our choice.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from .tissue import CREEP_SPAN

CREEP_END = 600.0
"""Time after which the rest posture stays, where its course has no end of its own [s]. Assumed."""


@dataclass(frozen=True)
class PowerCreep:
    """Creep by a power of time, or by the logarithm at the exponent 0: ((1 + t/onset)^n − 1) / n."""

    exponent: float
    """Exponent n [-]."""

    onset: float
    """Time until which the creep is nearly linear [s]."""

    def share(self, time: ca.SX) -> ca.SX:
        """Share of the creep at a time since the start [s]."""
        at_span = 1.0 + CREEP_SPAN / self.onset
        now = 1.0 + ca.fmin(time, CREEP_END) / self.onset
        if self.exponent == 0.0:
            return ca.log(now) / np.log(at_span)
        return (now**self.exponent - 1.0) / (at_span**self.exponent - 1.0)


@dataclass(frozen=True)
class LateCreep:
    """Creep that begins slowly and ends after `CREEP_SPAN`: 3 u² − 2 u³."""

    def share(self, time: ca.SX) -> ca.SX:
        """Share of the creep at a time since the start [s]."""
        u = ca.fmin(time / CREEP_SPAN, 1.0)
        return u**2 * (3.0 - 2.0 * u)


CreepCourse = PowerCreep | LateCreep


def draw_course(generator: np.random.Generator) -> CreepCourse:
    """Draw one of the three courses; the ranges are assumed."""
    kind = int(generator.integers(3))
    exponent, onset = float(generator.uniform(0.1, 0.6)), float(np.exp(generator.uniform(0.0, np.log(20.0))))
    return (PowerCreep(exponent, onset), PowerCreep(0.0, onset), LateCreep())[kind]
