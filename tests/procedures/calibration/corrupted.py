"""Rigs with a wrong driver, and the verdict of their calibration.

This is a script, so that shape checks do not slow the ticks.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ExogravError
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.tree import Tree
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.calibrate import calibrate_machine
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.safety.envelope import Envelope
from exograv.signals import Command, JointState

SEED = 1012
LENGTHS = {"upper_arm": 0.29}
BLOCKED_NM = 20.0  # Coulomb friction of a joint that no push may move
Change = Callable[[np.ndarray], np.ndarray]


def unchanged(values: np.ndarray) -> np.ndarray:
    """Return the values unchanged."""
    return values


def scaled(joint: int, factor: float) -> Change:
    """Return a change that scales the value of one joint by a factor."""

    def change(values: np.ndarray) -> np.ndarray:
        wrong = values.copy()
        wrong[joint] *= factor
        return wrong

    return change


def shifted(joint: int, by: float) -> Change:
    """Return a change that shifts the value of one joint."""

    def change(values: np.ndarray) -> np.ndarray:
        wrong = values.copy()
        wrong[joint] += by
        return wrong

    return change


def swapped(one: int, other: int) -> Change:
    """Return a change that swaps the values of two joints."""

    def change(values: np.ndarray) -> np.ndarray:
        wrong = values.copy()
        wrong[[one, other]] = values[[other, one]]
        return wrong

    return change


@dataclass
class Corrupted:
    """Rig with a wrong driver between the computer and a twin."""

    twin: Twin
    position: Change
    current: Change
    command: Change
    names: tuple[str, ...] | None
    v_max: float = 0.0
    """Largest true speed so far [rad/s]."""
    tau_max: float = 0.0
    """Largest command so far, over the motor's largest torque [-]."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints in the order of the driver."""
        return self.names or self.twin.joints

    @property
    def period_s(self) -> float:
        """Duration of a tick [s]."""
        return self.twin.period_s

    @property
    def t(self) -> float:
        """Time on the rig's clock [s]."""
        return self.twin.t

    def read(self) -> JointState:
        """Read the state as the driver reports it. A joint with wrong wiring or description has two wrong encoders."""
        state = self.twin.read()
        q_motor = None if state.q_motor is None else self.position(state.q_motor)
        return state._replace(q=self.position(state.q), current=self.current(state.current), q_motor=q_motor)

    def write(self, command: Command) -> None:
        """Write the command as the driver passes it on."""
        self.twin.write(command._replace(current=self.command(command.current)))
        truth = self.twin.truth
        self.tau_max = max(self.tau_max, float(np.abs(command.tau / truth.machine.drives.torque_max).max()))
        self.v_max = max(self.v_max, float(np.abs(truth.v).max()))

    def __enter__(self) -> "Corrupted":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


@dataclass(frozen=True)
class Case:
    """Machine with a single fault."""

    rig: str = "recupera_like"
    position: Change = unchanged
    current: Change = unchanged
    command: Change = unchanged
    names: tuple[str, ...] | None = None
    blocked: int | None = None
    weight_share: float = 1.0
    start_deg: dict[int, float] = field(default_factory=dict)
    """Start angles of joints that do not start in the hanging posture [°], by joint."""
    constant: tuple[int, float] | None = None
    """Joint, and factor on its torque constant in rig.toml."""


OTHER_ORDER = ("elbow_flexion", "shoulder_flexion", "shoulder_abduction", "shoulder_rotation")
QDD = "recupera_like_qdd"


def motor(change: Change, rig: str = "recupera_like", position: Change = unchanged) -> Case:
    """Return a case in which command and measured current have the same error."""
    return Case(rig, position, change, change)


QUICK = {
    "encoder reversed": Case(position=scaled(0, -1.0)),
    "encoder reversed, light": Case(QDD, position=scaled(0, -1.0)),
    "encoder reversed where nothing weighs": Case(position=scaled(2, -1.0)),
    "motor reversed": motor(scaled(0, -1.0)),
    "motor reversed, light": motor(scaled(0, -1.0), QDD),
    "motor reversed, its current not": Case(command=scaled(0, -1.0)),
    "degrees": Case(position=np.rad2deg),
    "degrees at zero": Case(position=scaled(1, float(np.rad2deg(1.0))), start_deg={1: 0.0}),
    "current in mA": Case(current=scaled(0, 1000.0)),
    "drive takes mA": Case(command=scaled(0, 0.001)),
    "drive gives kA": Case(command=scaled(0, 1000.0)),
    "drive gives kA, light": Case(QDD, command=scaled(0, 1000.0)),
    "drive gives kA and says A": Case(command=scaled(0, 1000.0), current=scaled(0, 0.001)),
    "drive gives kA and says A, light": Case(QDD, command=scaled(0, 1000.0), current=scaled(0, 0.001)),
    "constant in mN·m": Case(constant=(2, 1000.0)),
    "constant in kN·m": Case(constant=(2, 0.001)),
    "other order": Case(names=OTHER_ORDER),
    "encoders swapped": Case(position=swapped(0, 1)),
    "motors swapped": motor(swapped(0, 1)),
    "all swapped": motor(swapped(0, 3), position=swapped(0, 3)),
    "all reversed": motor(scaled(0, -1.0), position=scaled(0, -1.0)),
    "blocked": Case(blocked=0),
    "blocked, light": Case(QDD, blocked=0),
    "disconnected": Case(command=scaled(0, 0.0), current=scaled(0, 0.0)),
    "disconnected, noise measured": Case(command=scaled(0, 0.0)),
}
SLOW = {
    "weights in pounds": Case(weight_share=0.45359237),
    "all reversed where nothing weighs": motor(scaled(2, -1.0), position=scaled(2, -1.0)),
    "encoder shifted": Case(position=shifted(3, 0.09)),
    "gain for peak current": Case(command=scaled(1, 1.5), current=scaled(1, 1.0 / 1.5)),
    "nothing wrong": Case(),
}


def verdict(case: Case) -> dict[str, Any]:
    """Return the verdict of the calibration of a corrupted machine, and its true largest speed."""
    rig = described(case)
    tree = adjusted(read_exoskeleton(rig), rig, LENGTHS)
    corrupted = Corrupted(corrupted_twin(case, rig, tree), case.position, case.current, case.command, case.names)
    gains = ActuatorGain(rig.nominal_gain, 0.08 * rig.nominal_gain)
    pilot = Pilot(corrupted, gains, Envelope(limits(rig), corrupted.period_s))
    kind, text = "", ""
    try:
        operator = ComputedOperator(lambda mount, kg: corrupted.twin.hang(mount, case.weight_share * kg))
        calibrate_machine(rig, tree, pilot, operator)
    except ExogravError as error:
        kind, text = type(error).__name__, str(error)
    return {"kind": kind, "text": text, "v_max": corrupted.v_max, "tau_max": corrupted.tau_max, "t": corrupted.twin.t}


def described(case: Case) -> RigDescription:
    """Return the machine as its files describe it."""
    rig = load_rig(case.rig)
    if case.constant is None:
        return rig
    joint, factor = case.constant
    drives = list(rig.settings.actuators)
    constant = factor * (drives[joint].torque_constant_Nm_per_A or 0.0)
    drives[joint] = drives[joint].model_copy(update={"torque_constant_Nm_per_A": constant})
    return replace(rig, settings=rig.settings.model_copy(update={"actuators": drives}))


def corrupted_twin(case: Case, rig: RigDescription, tree: Tree) -> Twin:
    """Return the twin with its true parameters."""
    machine = draw_machine(load_rig(case.rig), Disturbances.at_level(2), SEED)
    if case.blocked is not None:
        coulomb = machine.friction.coulomb.copy()
        coulomb[case.blocked] = BLOCKED_NM
        machine = replace(machine, friction=replace(machine.friction, coulomb=coulomb))
    start = starting_posture(tree)
    for joint, angle in case.start_deg.items():
        start[joint] = np.deg2rad(angle)
    return Twin(rig, machine, None, SEED, start, lengths=LENGTHS)


if __name__ == "__main__":
    cases = QUICK if sys.argv[1] == "quick" else SLOW
    print(json.dumps({name: verdict(case) for name, case in cases.items()}))
