"""Commands that a controller was given. A recording holds them in `/control`, so that the run can be flown again."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.model.arm import WeightPlace
from exograv.model.description import ArmSide

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class EmptyControllerRecord:
    """Controller of the empty machine, which the machine's own files make."""

    kind: Literal["empty"] = "empty"


@dataclass(frozen=True)
class ArmControllerRecord:
    """Controller of a worn machine, beside the machine's own files and the person as told."""

    kind: Literal["arm"] = field(default="arm", init=False)
    machine: CalibratedMachine
    x: Parameters


@dataclass(frozen=True)
class HangWeight:
    """Carry a known weight at a mount; zero takes it off."""

    act: Literal["hang"] = field(default="hang", init=False)
    place: str
    mass_kg: float


@dataclass(frozen=True)
class PublishParameters:
    """Head for new parameters."""

    act: Literal["publish"] = field(default="publish", init=False)
    x: Parameters
    q: Joints
    taken: bool


@dataclass(frozen=True)
class ForceParameters:
    """Put parameters in force at once."""

    act: Literal["force"] = field(default="force", init=False)
    x: Parameters


@dataclass(frozen=True)
class LeadArm:
    """Float one of two arms, which leads the other one."""

    act: Literal["lead"] = field(default="lead", init=False)
    side: ArmSide | None


@dataclass(frozen=True)
class CarryWeight:
    """Carry a known weight beside the arm; zero takes it off."""

    act: Literal["carry"] = field(default="carry", init=False)
    place: WeightPlace
    mass_kg: float
    q: Joints
    taken: bool


ControllerAct = HangWeight | PublishParameters | ForceParameters | LeadArm | CarryWeight

ACTS = {kind.act: kind for kind in (HangWeight, PublishParameters, ForceParameters, LeadArm, CarryWeight)}


def read_act(message: Mapping[str, Any]) -> ControllerAct:
    """Read a command from its message, to the last bit.

    Raises:
        KeyError: The message is none of a command.
    """
    kind = ACTS[message["act"]]
    values: dict[str, Any] = {one.name: message[one.name] for one in fields(kind) if one.init}
    values |= {name: np.array(values[name]) for name in ("x", "q") if name in values}
    return kind(**values)
