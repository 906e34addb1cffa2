"""What is on its way between the computer and the machine: commands and measurements, each some whole steps late."""

from dataclasses import dataclass

import casadi as ca

from .machine_bodies import TIMESTEP


@dataclass(frozen=True)
class Delays:
    """Half of the delay before the motors, half behind the sensors."""

    to_motors: int
    """Steps of a command."""

    to_computer: int
    """Steps of a measurement."""

    @classmethod
    def of(cls, seconds: float) -> "Delays":
        """Of sensor and command together [s]."""
        steps = round(seconds / TIMESTEP)
        return cls(steps - steps // 2, steps // 2)


def passed(line: ca.SX, newest: ca.SX) -> tuple[ca.SX, ca.SX]:
    """What leaves a line (entry, step) when `newest` enters it, and the line then; oldest first."""
    whole = ca.horzcat(line, newest)
    return whole[:, 0], whole[:, 1:]
