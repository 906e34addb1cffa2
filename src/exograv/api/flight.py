"""Identify and float an arm in a machine, simulated or real, behind the guard."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.identification.core.interface import Outcome

from .estimate import Estimate
from .law import Law
from .recording import Recording

IDENTIFY_S = (10.0, 600.0)
"""Range of the length of an identification's motion [s]."""

FLOAT_S = (1.0, 7200.0)
"""Range of the length of a flight [s]."""


@dataclass(frozen=True)
class FlightPlan:
    """Arguments of `float_arm`, checked."""

    estimate: Estimate | None
    identify_s: float
    gravity_level: float
    seconds: float
    path: Path
    law: Law | None = None

    def __post_init__(self):
        if self.estimate is not None and self.estimate.outcome == Outcome.DISAGREES.value:
            raise ConfigError(
                "estimate disagreed with its check at unused postures, so it must not be floated. Leave it out: "
                "`float_arm` then identifies the arm, with a new check if identify_s is 40 or more."
            )
        for name, value, (least, most) in (
            ("identify_s", self.identify_s, IDENTIFY_S),
            ("gravity_level", self.gravity_level, (0.0, 1.0)),
            ("seconds", self.seconds, FLOAT_S),
        ):
            if not least <= value <= most:
                raise ConfigError(f"{name} is {value}; allowed: {least:g} to {most:g}.")


@dataclass(frozen=True)
class Flight:
    """Result of `float_arm`: estimate, recording, stops and drift."""

    estimate: Estimate
    """Estimate of the arm. `Estimate.carried` states which part of it was floated."""
    path: Path
    """File of the recording."""
    stops: tuple[str, ...] = ()
    """Causes of the guard's stops; empty if the flight ended as planned."""
    drift_deg: Float[np.ndarray, " joint"] | None = None
    """Largest distance of each joint from the posture of release [°]; None if it was not measured."""
    why: str = ""
    """Sentences on an arm that is carried only in part: axes, reason, next step; empty if all of it is carried."""
    left_over_true: Float[np.ndarray, " joint"] | None = None
    """True left over of the carried arm at held-out postures, RMS per joint [N·m]; None for a real machine."""

    def recording(self) -> Recording:
        """Read the recording of the flight."""
        return Recording(self.path)


@runtime_checkable
class Machine(Protocol):
    """Machine that `float_arm` accepts: `Twin` or `Drives`."""

    def float_as_planned(self, plan: FlightPlan) -> Flight:
        """Identify and float an arm as `plan` says."""
        ...


def float_arm(
    machine: Machine,
    estimate: Estimate | None = None,
    *,
    identify_s: float = 20.0,
    gravity_level: float = 0.0,
    seconds: float = 10.0,
    path: str | Path = "out/flight.mcap",
    law: Law | None = None,
) -> Flight:
    """Float the arm in the machine; without an estimate, first move the relaxed arm and identify it.

    The guard limits every torque, and a fault ends in a soft descent. A real machine moves only after its self-test of
    the day.

    Args:
        machine: `Twin` or `Drives`.
        estimate: Estimate of an earlier identification, on the twin only. On drives it must be None, because each
            flight identifies the arm.
        identify_s: Length of the motion in which the arm is identified, 10 to 600 [s].
        gravity_level: Share of its own weight that the arm feels: 0 weightless, 1 Earth.
        seconds: Length of the flight after that [s].
        path: File of the recording.
        law: Torque to add to the compensation, as a function of position [rad], velocity [rad/s] and time [s]; on the
            twin only. The guard limits the sum.

    Raises:
        ConfigError: An argument is not allowed.
        ModelError: The machine does not fit the person.
        RigError: The machine is locked, or the guard stopped the simulated run.
        RecordingError: The recording cannot be written.
    """
    return machine.float_as_planned(FlightPlan(estimate, identify_s, gravity_level, seconds, Path(path), law))
