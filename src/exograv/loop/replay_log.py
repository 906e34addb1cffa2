"""Contents of a recording that allow `exograv data replay` to repeat the run without the machine."""

import math
import os
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Protocol, runtime_checkable

import numpy as np

import exograv
from exograv import kernel
from exograv.control.controller_acts import ArmControllerRecord, ControllerAct, EmptyControllerRecord
from exograv.control.tick import ControlMode
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.recording import RecordingWriter
from exograv.recording.code import code_sha256
from exograv.recording.guard_state import EVERY_S, guard_message
from exograv.results import JsonObject, json_value
from exograv.safety.limits import PersonLimits
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.record import GuardRecord
from exograv.safety.state import VERSION, state_places

PACKAGES = ("casadi", "mujoco-core", "numpy", "scipy")


@runtime_checkable
class ReplayableController(Protocol):
    """Interface of a controller that can be rebuilt from its own description."""

    acts: list[ControllerAct]
    """Commands since the last record was written."""

    def described(self) -> EmptyControllerRecord | ArmControllerRecord:
        """Describe the parts of the controller that are not in the machine's own files or in the participant's data."""
        ...


class ReplayLog:
    """Log of all inputs to a pilot's controllers. Each input is written before the tick in which it takes effect."""

    def __init__(self, recording: RecordingWriter, actuators: ActuatorGain, period_s: float):
        self._recording, self._actuators, self._period_s = recording, actuators, period_s
        self._known: list[object] = []
        self._flying: object = None
        self._accountable: ReplayableController | None = None
        self._person: GuardedPerson | None = None
        self._felt = (0.0, False)
        self._keeps_next = -math.inf

    def keep_guard(self, t: float, now: float, record: GuardRecord) -> None:
        """Write the state of the guard after a tick, from time to time."""
        if now >= self._keeps_next:
            self._keeps_next = now + EVERY_S
            state = record.view[state_places(record)]
            self._recording.write("/guard", t, guard_message(now, 0, VERSION, state))

    def note(self, t: float, controller: object, person: GuardedPerson | None) -> None:
        """Write the changes before the tick at time `t` [s]: controller, wearer, and commands to the controller."""
        if controller is not self._flying:
            self._take_over(t, controller)
        if person is not self._person:
            self._wear(t, person)
        elif person is not None and (person.gravity_level, person.is_driven) != self._felt:
            self._felt = person.gravity_level, person.is_driven
            self._recording.write("/control", t, {"act": "level", **_felt(person)})
        if self._accountable is not None and self._accountable.acts:
            for act in self._accountable.acts:
                self._recording.write("/control", t, json_value(act))
            self._accountable.acts.clear()

    def _wear(self, t: float, person: GuardedPerson | None) -> None:
        self._person = person
        limits = None if person is None else written_person(person.limits)
        self._felt = (0.0, False) if person is None else (person.gravity_level, person.is_driven)
        felt = {} if person is None else _felt(person)
        self._recording.write("/control", t, {"act": "wear", "person": limits, **felt})

    def _take_over(self, t: float, controller: object) -> None:
        if self._flying is None:
            actuators = asdict(self._actuators)
            self._recording.write(
                "/control", t, {"act": "pilot", "period_s": self._period_s, "actuators": actuators}
            )  # fmt: skip
        self._flying = controller
        # The controller is checked once only: the check of a protocol takes longer than the torque of a tick.
        self._accountable = controller if isinstance(controller, ReplayableController) else None
        new: JsonObject = {}
        if not any(controller is one for one in self._known):
            self._known.append(controller)
            new = json_value(self._accountable.described()) if self._accountable is not None else {"kind": "other"}
        number = next(k for k, one in enumerate(self._known) if one is controller)
        self._recording.write("/control", t, {"act": "fly", "controller": number, **new})


def _felt(person: GuardedPerson) -> JsonObject:
    return {"gravity_level": person.gravity_level, "is_driven": person.is_driven}


NO_MODE = math.nan, math.nan, math.nan


def mode_values(controller: object) -> tuple[float, float, float]:
    """Return drive factor, gravity level and arm share of a controller; NaN if it carries no arm."""
    mode = getattr(controller, "mode", None)
    return (mode.drive, mode.gravity_level, mode.arm_share) if isinstance(mode, ControlMode) else NO_MODE


def written_rig(description: RigDescription) -> dict[str, str]:
    """Texts of the machine's own files by name. A recording must stay readable when the folder changes."""
    files = (description.folder / "rig.toml", description.urdf_path)
    # The URDF may belong to another machine, in a folder beside this one.
    return {os.path.relpath(path, description.folder): path.read_text(encoding="utf-8") for path in files}


@dataclass(frozen=True)
class ToldPerson:
    """Person as measured by scale, tape and form, and the set lengths of the machine, without rounding."""

    body: Body
    lengths_m: Mapping[str, float]


def read_machine(message: Mapping[str, Any]) -> CalibratedMachine:
    """Read the machine as calibrated, exact to the last bit."""
    plain = {name: np.array(message[name]) for name in ("phi", "gravity", "rotor_inertia", "residual_sd")}
    return CalibratedMachine(
        actuators=read_actuators(message["actuators"]),
        friction=_friction(message["friction"]),
        friction_sd=_friction(message["friction_sd"]),
        correlation_s=np.array(message["correlation_s"]),
        **plain,
    )


def read_actuators(message: Mapping[str, Any]) -> ActuatorGain:
    """Read the gains of the drives."""
    return ActuatorGain(np.array(message["gain"]), np.array(message["gain_sd"]))


def _friction(message: Mapping[str, Any]) -> Friction:
    columns = {name: np.array(values) for name, values in message.items() if name != "v_rest"}
    return Friction(**columns, v_rest=message["v_rest"])


def written_person(limits: PersonLimits) -> JsonObject:
    """Write the limits of a person for `read_person`. Infinite limits are left out, because JSON has no infinity."""
    return {name: value for name, value in asdict(limits).items() if not _is_endless(value)}


def _is_endless(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)


def read_person(message: Mapping[str, Any]) -> PersonLimits:
    """Read the guard's limits of the person, exact to the last bit."""
    table = message["table"]
    chains = tuple(_limb(one) for one in table["chains"])
    bounds = {name: np.array(table[name]) for name in ("error", "dry", "viscous")}
    arrays = {name: np.array(message[name]) for name in ("active_max_Nm", "q_lower", "q_upper")}
    rest = {name: value for name, value in message.items() if name not in {"table", *arrays}}
    return PersonLimits(table=PlausibleTable(chains, **bounds), **arrays, **rest)


def _limb(message: Mapping[str, Any]) -> LimbTable:
    arrays = {name: np.array(message[name]) for name in ("exo", "arm", "potential") if name in message}
    # Recordings up to version 0.1 have no potential: all products are in the rows, in the same order of summation.
    return LimbTable(
        tuple(message["joints"]),
        message["most_factors"],
        potential_factors=message.get("potential_factors", 0),
        **arrays,
    )


def versions() -> dict[str, str]:
    """Versions of everything that affects the last bit of a torque."""
    engine = "native" if kernel.compilation.native_is_possible() else "virtual machine"
    found = {"exograv": exograv.__version__, "python": platform.python_version()}
    found |= {"kernel": engine, "processor": platform.machine(), "code": code_sha256()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found
