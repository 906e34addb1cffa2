"""Forces of the twin that MuJoCo does not model, as one function on MuJoCo's own memory."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.rig.twin.machine.delays import Delays, passed
from exograv.rig.twin.machine.drive import (
    DRIVE_STATES,
    FOREIGN_STATES,
    TAU_MOTOR,
    THETA,
    DriveInput,
    drive_step,
    foreign_drive_step,
)
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.wearer.arm_bodies import ArmPlace
from exograv.rig.twin.wearer.contact_cuffs import ContactCuffs
from exograv.rig.twin.wearer.curved_path import CurvedPath
from exograv.rig.twin.wearer.passive import (
    LateShift,
    elastic_torque,
    follower_paths,
    late_shift,
    passive_torque,
    relaxation,
    shift_forces,
    shoulder_shifts,
    swinging_shift,
)
from exograv.rig.twin.wearer.wearer import Wearer

from .cuffs import CuffStates, Kinematics, cuff_wrenches, lag, slip
from .scene import TIMESTEP, Scene

WATCHDOG_S = 0.02
"""Age of the last valid command after which a drive brakes its motor by itself [s].

docs/explanation/safety.md: a drive brakes 20 to 30 ms after its last command; 5 ms of them are the life of the command.
"""


SLIPPED = "slipped"
"""Name of the state that holds the ways by which cuffs have slipped along the limb (cuff,) [m]."""

LAGGED = "lagged"
"""Name of the state that holds the strains of the lagging flesh under the cuffs (3, cuff) [m]."""


@dataclass(frozen=True)
class StepInput:
    """Inputs of a step, as symbols; the step's kernel has its memory under the same names."""

    qpos: ca.SX
    """Positions of MuJoCo [rad, m]."""

    qvel: ca.SX
    """Velocities of MuJoCo [rad/s, m/s]."""

    current: ca.SX
    """Current of the newest command (joint,) [A]."""

    damping: ca.SX
    """Damping of the newest command (joint,) [N·m·s/rad]."""

    valid_until: ca.SX
    """Time until which the newest command is valid [s]."""

    tau_muscle: ca.SX
    """Involuntary muscle torque of the wearer (arm,) [N·m]."""

    tau_voluntary: ca.SX
    """Voluntary muscle torque of the wearer (arm,) [N·m]."""

    tau_hand: ca.SX
    """Torque of a person who turns the machine's joints by hand (joint,) [N·m]."""

    warmth: ca.SX
    """Warm-up of the drives: 0 cold, 1 warm [-]."""

    start: ca.SX
    """Time of the first step [s]."""

    steps: ca.SX
    """Number of steps done; this and all fields below are carried from step to step [-]."""

    drives: ca.SX
    """States of the drives (drive state, joint), in the order of `DRIVE_STATES`."""

    hysteresis: ca.SX
    """State of the hysteresis of the arm's joints (arm, mode) [rad]; one mode at home."""

    commands: ca.SX
    """Commands in the delay line (torque [N·m] and damping [N·m·s/rad] of each joint, valid until [s]; step)."""

    measurements: ca.SX
    """Measurements in the delay line, oldest first.

    Position [rad], motor torque [N·m] and motor position [rad] of each joint (row), by steps (column).
    """

    @classmethod
    def of(cls, scene: Scene, delays: Delays, modes: int = 1) -> "StepInput":
        """Return new symbols of the sizes of a scene; `modes` is the number of modes of the hysteresis."""
        n, n_arm = len(scene.exo), len(scene.arm)
        sizes = {
            "qpos": (scene.model.nq,), "qvel": (scene.model.nv,), "current": (n,), "damping": (n,), "valid_until": (),
            "tau_muscle": (n_arm,), "tau_voluntary": (n_arm,), "tau_hand": (n,), "warmth": (), "start": (), "steps": (),
            "drives": (len(DRIVE_STATES), n), "hysteresis": (n_arm, modes),
            "commands": (2 * n + 1, delays.to_motors), "measurements": (3 * n, delays.to_computer),
        }  # fmt: skip
        return cls(**{name: ca.SX.sym(name, *size) for name, size in sizes.items()})


@dataclass
class ForeignStates:
    """States that only the laws of a foreign world carry from step to step; at home there are none."""

    symbols: dict[str, ca.SX] = field(default_factory=dict)
    next: dict[str, ca.SX] = field(default_factory=dict)

    def new(self, name: str, *size: int) -> ca.SX:
        """Return the symbol of a new state; its next value belongs into `next`."""
        self.symbols[name] = ca.SX.sym(name, *size)
        return self.symbols[name]


def step_forces(scene: Scene, machine: Machine, wearer: Wearer | None) -> kernel.Kernel:
    """Delays, drives, cuffs, passive joints and muscles, for one step of the scene; memory as in `StepInput`.

    Evaluate the kernel between `mj_step1` and `mj_step2`.
    """
    modes = 1 if wearer is None else len(relaxation(wearer.passive))
    kinematics, now = Kinematics.of(scene.model.nbody), StepInput.of(scene, Delays.of(machine.sensors.delay), modes)
    carried: dict[str, ca.SX] = {"steps": now.steps + 1}
    foreign = ForeignStates()
    told, carried["commands"] = _arriving(machine, now)
    at_joints = ca.vertcat(now.qpos[scene.exo.tolist()], now.drives[TAU_MOTOR, :].T, now.drives[THETA, :].T)
    carried["measurements"] = passed(now.measurements, at_joints)[1]
    qfrc, carried["drives"] = _drive_forces(scene, machine, now, told, foreign)
    xfrc = ca.SX.zeros(6, scene.model.nbody)
    if wearer is not None:
        xfrc = cuff_wrenches(scene, wearer.cuffs, kinematics, _cuff_states(scene, wearer, kinematics, foreign))
        arm_forces, carried["hysteresis"] = _arm_forces(scene, wearer, now, foreign)
        qfrc += arm_forces
    carried |= foreign.next
    inputs, results = vars(kinematics) | vars(now) | foreign.symbols, {"xfrc_applied": xfrc, "qfrc_applied": qfrc}
    results["damping_in_force"] = told.damping
    results |= {f"{name}_next": value for name, value in carried.items()}
    function = ca.Function(
        "twin_step_forces", list(inputs.values()), list(results.values()), list(inputs), list(results)
    )
    return kernel.compile(function, _bindings(scene, kinematics), carry={name: f"{name}_next" for name in carried})


def _cuff_states(scene: Scene, wearer: Wearer, kinematics: Kinematics, foreign: ForeignStates) -> CuffStates:
    """Return the states of the cuffs after this step; none at home."""
    law, count = wearer.cuffs.strained, len(scene.cuffs)
    if law is None:
        return CuffStates()
    slipped = foreign.next[SLIPPED] = slip(scene, wearer.cuffs, law, kinematics, foreign.new(SLIPPED, count))
    if not isinstance(law, ContactCuffs):
        return CuffStates(slipped)
    lagged = foreign.next[LAGGED] = lag(scene, law, kinematics, foreign.new(LAGGED, 3, count))
    return CuffStates(slipped, lagged)


def pass_clock(memory: Mapping[str, np.ndarray], seconds: float) -> None:
    """Advance the clock by `seconds` [s] while nothing moves.

    Commands in force and in the delay line keep their age.
    """
    memory["start"][0] += seconds
    memory["valid_until"][0] += seconds
    np.atleast_2d(memory["commands"].T)[:, -1] += seconds


@dataclass(frozen=True)
class _Told:
    """Commands that reach the drives in one step, one entry per joint."""

    tau: ca.SX
    """Commanded torque of each joint [N·m]."""

    damping: ca.SX
    """Commanded damping of each joint [N·m·s/rad]."""


def _arriving(machine: Machine, now: StepInput) -> tuple[_Told, ca.SX]:
    """Return the command that reaches the drives in this step, and the commands behind it.

    An expired command gives no torque. If no valid command comes for `WATCHDOG_S`, each drive brakes by itself.
    """
    drives = machine.drives
    torque_max = ca.DM(drives.torque_max)
    tau = ca.fmin(ca.fmax(ca.DM(drives.gain) * now.current, -torque_max), torque_max)
    oldest, behind = passed(now.commands, ca.vertcat(tau, now.damping, now.valid_until))
    tau, damping, valid_until = ca.vertsplit(oldest, [0, tau.numel(), 2 * tau.numel(), 2 * tau.numel() + 1])
    age = now.start + now.steps * TIMESTEP - valid_until
    braked = ca.if_else(age > WATCHDOG_S, ca.DM(drives.watchdog_damping), 0.0)
    return _Told(ca.if_else(age <= 0.0, tau, 0.0), ca.if_else(age <= 0.0, damping, braked)), behind


def _drive_forces(
    scene: Scene, machine: Machine, now: StepInput, told: "_Told", foreign: ForeignStates
) -> tuple[ca.SX, ca.SX]:
    """Return the forces of all drives (dof,) [N·m], and their next states."""
    qfrc, next_states, next_foreign = ca.SX.zeros(scene.model.nv), [], []
    laws = machine.foreign
    states = None if laws is None else foreign.new("foreign_drives", FOREIGN_STATES, len(scene.exo))
    for joint, dof in enumerate(scene.exo.tolist()):
        seen = DriveInput(told.tau[joint], now.qpos[dof], now.qvel[dof], now.warmth, told.damping[joint])
        state = now.drives[:, joint]
        if laws is None or states is None:
            step = drive_step(machine, joint, state, seen, TIMESTEP)
        else:
            step = foreign_drive_step(machine, laws, joint, (state, states[:, joint]), seen, TIMESTEP)
            next_foreign.append(step.foreign_next)
        qfrc[dof] += step.tau_joint + now.tau_hand[joint]
        next_states.append(step.state_next)
    if next_foreign:
        foreign.next["foreign_drives"] = ca.horzcat(*next_foreign)
    return qfrc, ca.horzcat(*next_states)


def _arm_forces(scene: Scene, wearer: Wearer, now: StepInput, foreign: ForeignStates) -> tuple[ca.SX, ca.SX]:
    """Return the forces of the wearer's joints and shoulders (dof,) [N·m, N], and the next state of the hysteresis."""
    arm, qfrc = scene.arm.tolist(), ca.SX.zeros(scene.model.nv)
    crept = None
    if wearer.passive.tissue is not None:
        tissue = wearer.passive.tissue
        state = foreign.new("crept", tissue.creep_states)
        foreign.next["crept"] = tissue.crept(state, TIMESTEP)
        crept = tissue.rest_moved(state)
    passive = passive_torque(wearer.passive, now.qpos[arm], now.qvel[arm], now.hysteresis, TIMESTEP, crept)
    reactions = []
    for place in scene.arms:
        q, v = now.qpos[place.freedoms.tolist()], now.qvel[place.freedoms.tolist()]
        of_arm = ca.SX.zeros(len(place.freedoms))
        if place.shifts:
            shifts = shoulder_shifts(place.skeleton, q, wearer.glenohumeral_share, wearer.shoulder_path)
            late = _late_shifts(shifts, place, wearer, foreign)
            for i, shift, one in zip(place.shifts, shifts, late, strict=True):
                qfrc[i], reaction = shift_forces(shift, q, v, now.qpos[i], now.qvel[i], one)
                of_arm += reaction
        reactions.append(of_arm)
    qfrc[arm] = passive.tau + ca.vertcat(*reactions) + (now.tau_muscle + now.tau_voluntary)
    return qfrc, passive.hysteresis_next


def _late_shifts(
    shifts: tuple[ca.SX, ...], place: ArmPlace, wearer: Wearer, foreign: ForeignStates
) -> tuple[LateShift | None, ...]:
    """Return the places to which the girdle has brought a shoulder's centre; None where it does not lag."""
    path, name = wearer.shoulder_path, late_name(place)
    if path is None:
        return (None,)
    if isinstance(path, CurvedPath):
        states = ca.vertsplit(foreign.new(name, len(shifts), 2))
        late = [swinging_shift(shift, state, path, TIMESTEP) for shift, state in zip(shifts, states, strict=True)]
    else:
        late = [late_shift(shifts[0], foreign.new(name), path, TIMESTEP)]
    foreign.next[name] = ca.vertcat(*(one.next for one in late))
    return tuple(late)


def late_name(place: ArmPlace) -> str:
    """Name of the state of a shoulder's centre that lags."""
    return f"{place.skeleton.side}_shoulder"


def measured_truth(scene: Scene, machine: Machine) -> ca.Function:
    """Position [rad], motor torque [N·m] and motor position [rad] that are measured now; memory as in `StepInput`."""
    n, delays = len(scene.exo), Delays.of(machine.sensors.delay)
    now = StepInput.of(scene, delays)
    if delays.to_computer == 0:
        at_joints = [now.qpos[scene.exo.tolist()], now.drives[TAU_MOTOR, :].T, now.drives[THETA, :].T]
        names = ["q", "tau_motor", "q_motor"]
        return ca.Function("twin_now", [now.qpos, now.drives], at_joints, ["qpos", "drives"], names)
    oldest = ca.vertsplit(now.measurements[:, 0], n)
    return ca.Function("twin_late", [now.measurements], oldest, ["measurements"], ["q", "tau_motor", "q_motor"])


def static_forces(scene: Scene, wearer: Wearer, with_passive: bool) -> kernel.Kernel:
    """Return the forces of the cuffs at rest, and of the passive joints if `with_passive`.

    Also the joints that follow the arms: `led` (follower,) [m, rad] and its `slope` (follower, arm).
    """
    kinematics = Kinematics.of(scene.model.nbody)
    qpos = ca.SX.sym("qpos", scene.model.nq)
    q_arm = ca.SX.sym("q_arm", len(scene.arm))
    arm = scene.arm.tolist()
    qfrc = ca.SX.zeros(scene.model.nv)
    if with_passive:
        qfrc[arm] += elastic_torque(wearer.passive, qpos[arm])
    led = follower_paths(wearer, q_arm)
    slope = ca.vertcat(*(ca.gradient(path, q_arm).T for path in ca.vertsplit(led)))
    function = ca.Function(
        "twin_static_forces",
        [*vars(kinematics).values(), qpos],
        [
            cuff_wrenches(scene, wearer.cuffs, kinematics),
            qfrc,
            *(ca.substitute(e, q_arm, qpos[arm]) for e in (led, slope)),
        ],
        [*vars(kinematics), "qpos"],
        ["xfrc_applied", "qfrc_applied", "led", "slope"],
    )
    return kernel.compile(
        function, {name: array for name, array in _bindings(scene, kinematics).items() if name != "qvel"}
    )


def _bindings(scene: Scene, kinematics: Kinematics) -> dict[str, np.ndarray]:
    names = [*vars(kinematics), "qpos", "qvel", "xfrc_applied", "qfrc_applied"]
    # Flat: MuJoCo's rows are the kernel's columns, and the order of a square matrix would be ambiguous.
    return {name: getattr(scene.data, name).reshape(-1) for name in names}
