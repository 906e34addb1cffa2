"""Score of a controller on the twin's truth: residual torque at postures that no estimator has seen."""

from collections.abc import Callable, Mapping

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.wearer.wearer import Wearer
from exograv.rig.twin.world.scene import Scene, build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.sobol import sobol_points

HELD_OUT = 200
"""Number of held-out postures."""

HELD_OUT_SEED = 20_260_101
"""Seed of the held-out postures. It never changes: every method, wearer and motion is scored at the same postures."""

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]
CurrentsOf = Callable[[Postures], Postures]
"""Function that returns the motor currents [A] of a controller at rest for measured joint positions [rad], one row per
posture."""


def held_out_postures(description: RigDescription) -> Postures:
    """Quasi-random true postures in the task workspace [rad]."""
    lower, upper = description.workspace
    # Sobol points are balanced in powers of two. The first 200 of 256 are as good as any 200 of them.
    points = sobol_points(len(lower), HELD_OUT, np.random.default_rng(HELD_OUT_SEED))
    return points * (upper - lower) + lower


class Examiner:
    """Static truth of one wearer in one machine, computed by the twin's engine.

    Controllers and estimators must not use it.
    """

    def __init__(
        self,
        description: RigDescription,
        machine: Machine,
        wearer: Wearer | None,
        lengths: Mapping[str, float] | None = None,
        postures: Postures | None = None,
    ) -> None:
        """Build the scenes with and without the mass of the arm.

        Args:
            description: Description of the machine.
            machine: True parameters of the machine.
            wearer: Wearer in the machine; `None` leaves it empty.
            lengths: Settings of the adjustable lengths by segment, as for the twin [m].
            postures: Postures to score instead of the held-out ones [rad].
        """
        self._machine = machine
        self.postures = held_out_postures(description) if postures is None else postures
        """True positions of the machine's joints at which it is scored [rad]."""

        self._full = build_scene(description, machine, wearer, lengths)
        self._full_statics = Statics(self._full, wearer, with_passive=False)
        self._weightless = build_scene(description, machine, wearer, lengths)
        _take_arm_mass(self._weightless)
        self._weightless_statics = Statics(self._weightless, wearer, with_passive=False)
        self._cache: dict[tuple[float, bool], Postures] = {}

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Score with a cuff that has moved along the limb, as by `Twin.slide_cuff` [m]."""
        for scene in (self._full, self._weightless):
            scene.slide_cuff(name, along_m)
        self._cache.clear()

    def lock_torque(self, q: Joints, payload_kg: float = 0.0, arm: bool = True) -> Joints:
        """Torque [N·m] on the locked joints at true positions `q`, with the arm at rest in its cuffs.

        Friction and muscles give no torque.

        Args:
            q: Positions of the machine's joints [rad].
            payload_kg: Mass that hangs in the wearer's hand.
            arm: True if the arm has mass. Without mass it still strains the cuffs.
        """
        scene, statics = (self._full, self._full_statics) if arm else (self._weightless, self._weightless_statics)
        if len(scene.arm):
            scene.hang("hand", payload_kg)
        return statics.settle(q)[1]

    def lock_torques(self, payload_kg: float = 0.0, arm: bool = True) -> Postures:
        """Torque [N·m] on the locked joints at all held-out postures; computed once."""
        key = (payload_kg, arm)
        if key not in self._cache:
            self._cache[key] = np.array([self.lock_torque(q, payload_kg, arm) for q in self.postures])
        return self._cache[key]

    def left_over(self, currents_of: CurrentsOf, payload_kg: float = 0.0) -> Postures:
        """Lock torque minus the torque of the motors, for exoskeleton and arm together [N·m]; the main score."""
        return self.lock_torques(payload_kg) - self.delivered(currents_of)

    def arm_left_over(self, arm_currents_of: CurrentsOf, payload_kg: float = 0.0) -> Postures:
        """Arm's share of the lock torque minus the torque that the motors deliver for the arm [N·m]."""
        share = self.lock_torques(payload_kg) - self.lock_torques(arm=False)
        return share - self.delivered(arm_currents_of)

    def delivered(self, currents_of: CurrentsOf) -> Postures:
        """Torque [N·m] that the motors deliver at the held-out postures under this controller.

        The controller reads the positions with the encoders' offsets, but without quantisation and noise.
        """
        drives, offset = self._machine.drives, self._machine.sensors.encoder_offset
        currents = currents_of(self.postures + offset)
        torque = np.clip(drives.gain * currents, -drives.torque_max, drives.torque_max)
        foreign = self._machine.foreign
        # In a foreign world the gain depends on the angle. Heat is a state of the run: the motors are scored cold.
        return torque if foreign is None else foreign.gain_at(self.postures) * torque


def rms(left_over: Postures) -> Joints:
    """Root mean square over the postures, per joint [N·m]."""
    return np.sqrt(np.mean(left_over**2, axis=0))


def _take_arm_mass(scene: Scene) -> None:
    model = scene.model
    for arm in scene.arms:
        for body in arm.bodies:
            model.body_mass[body] = 0.0
            model.body_inertia[body] = 0.0
    # Statics needs no accelerations, but MuJoCo still divides by the mass matrix, which must not be singular.
    model.dof_armature[:] = 1.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
