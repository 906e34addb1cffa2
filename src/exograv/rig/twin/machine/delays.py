"""Delay lines between computer and machine, for commands and measurements, in whole time steps."""

from dataclasses import dataclass

import casadi as ca

from .machine_bodies import TIMESTEP


@dataclass(frozen=True)
class Delays:
    """Dead time in time steps: half of it before the motors, half behind the sensors."""

    to_motors: int
    """Steps by which a command is late."""

    to_computer: int
    """Steps by which a measurement is late."""

    @classmethod
    def of(cls, seconds: float) -> "Delays":
        """Return delays of measurement and command whose sum is `seconds` [s]."""
        steps = round(seconds / TIMESTEP)
        return cls(steps - steps // 2, steps // 2)


def passed(line: ca.SX, newest: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the oldest entry of a line (entry, step) and the line after `newest` has entered; oldest first."""
    whole = ca.horzcat(line, newest)
    return whole[:, 0], whole[:, 1:]
