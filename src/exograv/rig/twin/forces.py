"""All forces of the twin that MuJoCo does not know, as one function on MuJoCo's own memory."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from exograv import kernel

from .cuffs import Kinematics, cuff_wrenches
from .drive import DRIVE_STATES, DriveInput, drive_step
from .machine import Machine
from .passive import elastic_torque, passive_torque, shift_forces, shoulder_shift
from .scene import TIMESTEP, Scene
from .wearer import Wearer


@dataclass(frozen=True)
class StepForces:
    """The forces of one step.

    Call `kernel.evaluate` between `mj_step1` and `mj_step2`.
    """

    kernel: kernel.Kernel
    state: np.ndarray
    """Drives joint by joint in the order of `DRIVE_STATES`, then the hysteresis of the arm's joints; carried on."""

    tau_asked: np.ndarray
    """What the currents ask of the motors, as torque at the joint (joint,) [N·m]."""

    tau_muscle: np.ndarray
    """At the wearer's joints (arm,) [N·m]."""

    warmth: np.ndarray
    """0 cold, 1 warmed up (1,) [-]."""

    drives: np.ndarray
    """View of `state`: (joint, drive state)."""

    hysteresis: np.ndarray
    """View of `state`: (arm,)."""


def step_forces(scene: Scene, machine: Machine, wearer: Wearer | None) -> StepForces:
    """Drives, cuffs, passive joints and muscles, for one step of the scene."""
    n, n_arm, n_states = len(scene.exo), len(scene.arm), len(DRIVE_STATES)
    kinematics = Kinematics.of(scene.model.nbody)
    qpos, qvel = ca.SX.sym("qpos", scene.model.nq), ca.SX.sym("qvel", scene.model.nv)
    state = ca.SX.sym("state", n * n_states + n_arm)
    tau_asked, tau_muscle = ca.SX.sym("tau_asked", n), ca.SX.sym("tau_muscle", n_arm)
    warmth = ca.SX.sym("warmth")
    qfrc = ca.SX.zeros(scene.model.nv)
    next_states = []
    for joint, dof in enumerate(scene.exo.tolist()):
        own = state[joint * n_states : (joint + 1) * n_states]
        step = drive_step(machine, joint, own, DriveInput(tau_asked[joint], qpos[dof], qvel[dof], warmth), TIMESTEP)
        qfrc[dof] += step.tau_joint
        next_states.append(step.state_next)
    xfrc = ca.SX.zeros(6, scene.model.nbody)
    if wearer is not None:
        arm = scene.arm.tolist()
        xfrc = cuff_wrenches(scene, wearer.cuffs, kinematics)
        passive = passive_torque(wearer.passive, qpos[arm], qvel[arm], state[n * n_states :], TIMESTEP)
        share = wearer.glenohumeral_share
        force, reaction = shift_forces(qpos[arm], qvel[arm], qpos[scene.shift], qvel[scene.shift], share)
        qfrc[arm] += passive.tau + reaction + tau_muscle
        qfrc[scene.shift] += force
        next_states.append(passive.hysteresis_next)
    function = ca.Function(
        "twin_step_forces",
        [*vars(kinematics).values(), qpos, qvel, state, tau_asked, tau_muscle, warmth],
        [xfrc, qfrc, ca.vertcat(*next_states)],
        [*vars(kinematics), "qpos", "qvel", "state", "tau_asked", "tau_muscle", "warmth"],
        ["xfrc_applied", "qfrc_applied", "state_next"],
    )
    compiled = kernel.compile(function, _bindings(scene, kinematics), carry={"state": "state_next"})
    memory = compiled.inputs["state"]
    return StepForces(
        compiled,
        memory,
        compiled.inputs["tau_asked"],
        compiled.inputs["tau_muscle"],
        compiled.inputs["warmth"],
        drives=memory[: n * n_states].reshape(n, n_states),
        hysteresis=memory[n * n_states :],
    )


def static_forces(scene: Scene, wearer: Wearer, with_passive: bool) -> kernel.Kernel:
    """Cuffs at rest, and the passive joints if asked.

    Also the shoulder's path: `shift` [m] and its `slope` (arm,) [m/rad].
    """
    kinematics = Kinematics.of(scene.model.nbody)
    qpos = ca.SX.sym("qpos", scene.model.nq)
    q_arm = ca.SX.sym("q_arm", len(scene.arm))
    arm = scene.arm.tolist()
    qfrc = ca.SX.zeros(scene.model.nv)
    if with_passive:
        qfrc[arm] += elastic_torque(wearer.passive, qpos[arm])
    shift = shoulder_shift(q_arm, wearer.glenohumeral_share)
    function = ca.Function(
        "twin_static_forces",
        [*vars(kinematics).values(), qpos],
        [
            cuff_wrenches(scene, wearer.cuffs, kinematics),
            qfrc,
            *(ca.substitute(e, q_arm, qpos[arm]) for e in (shift, ca.gradient(shift, q_arm))),
        ],
        [*vars(kinematics), "qpos"],
        ["xfrc_applied", "qfrc_applied", "shift", "slope"],
    )
    return kernel.compile(
        function, {name: array for name, array in _bindings(scene, kinematics).items() if name != "qvel"}
    )


def _bindings(scene: Scene, kinematics: Kinematics) -> dict[str, np.ndarray]:
    names = [*vars(kinematics), "qpos", "qvel", "xfrc_applied", "qfrc_applied"]
    return {name: getattr(scene.data, name) for name in names}
