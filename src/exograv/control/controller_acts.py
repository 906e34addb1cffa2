"""Commands to a controller. A recording holds them in `/control`, so that the run can be replayed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.model.arm import WeightPlace
from exograv.model.description import ArmSide
from exograv.results import OPTIONAL

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class EmptyControllerRecord:
    """Controller of the empty machine; the machine's own files define it."""

    kind: Literal["empty"] = "empty"


@dataclass(frozen=True)
class ArmControllerRecord:
    """Controller of a worn machine; the machine's own files and the person's data complete it."""

    kind: Literal["arm"] = field(default="arm", init=False)
    machine: CalibratedMachine
    x: Parameters
    slid_m: tuple[float, ...] | None = field(default=None, metadata=OPTIONAL)
    """Way of each cuff along the limb since it was fastened [m]; None if no cuff has moved."""


@dataclass(frozen=True)
class HangWeight:
    """Command to carry a known weight at a mount; zero removes it."""

    act: Literal["hang"] = field(default="hang", init=False)
    place: str
    mass_kg: float


@dataclass(frozen=True)
class PublishParameters:
    """Command to ramp to new parameters."""

    act: Literal["publish"] = field(default="publish", init=False)
    x: Parameters
    q: Joints
    taken: bool


@dataclass(frozen=True)
class ForceParameters:
    """Command to apply parameters at once, without a ramp."""

    act: Literal["force"] = field(default="force", init=False)
    x: Parameters


@dataclass(frozen=True)
class LeadArm:
    """Command to float one of two arms, which leads the other arm."""

    act: Literal["lead"] = field(default="lead", init=False)
    side: ArmSide | None


@dataclass(frozen=True)
class CarryWeight:
    """Command to carry a known weight in addition to the arm; zero removes it."""

    act: Literal["carry"] = field(default="carry", init=False)
    place: WeightPlace
    mass_kg: float
    q: Joints
    taken: bool


ControllerAct = HangWeight | PublishParameters | ForceParameters | LeadArm | CarryWeight

ACTS = {kind.act: kind for kind in (HangWeight, PublishParameters, ForceParameters, LeadArm, CarryWeight)}


def read_act(message: Mapping[str, Any]) -> ControllerAct:
    """Read a command from its message, without loss of precision.

    Raises:
        KeyError: The message is not a command.
    """
    kind = ACTS[message["act"]]
    values: dict[str, Any] = {one.name: message[one.name] for one in fields(kind) if one.init}
    values |= {name: np.array(values[name]) for name in ("x", "q") if name in values}
    return kind(**values)
