"""Scores a controller on the twin's truth: what the motors leave over at postures that no estimator has seen."""

from collections.abc import Callable, Mapping

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.wearer.wearer import Wearer
from exograv.rig.twin.world.scene import Scene, build_scene
from exograv.rig.twin.world.statics import Statics

HELD_OUT = 200
"""Postures."""

HELD_OUT_SEED = 20_260_101
"""Fixed for ever: the same postures for every method, wearer and motion."""

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]
CurrentsOf = Callable[[Postures], Postures]
"""A controller at rest: from measured joint positions [rad] to motor currents [A], a row a posture."""


def held_out_postures(description: RigDescription) -> Postures:
    """Quasi-random true postures in the task workspace [rad]."""
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    lower, upper = description.workspace
    sobol = qmc.Sobol(d=len(lower), scramble=True, rng=np.random.default_rng(HELD_OUT_SEED))
    # Sobol points keep their balance in powers of two; the first 200 of 256 are as good as any.
    return qmc.scale(sobol.random_base2(8)[:HELD_OUT], lower, upper)


class Examiner:
    """Static truth of one wearer in one machine, by the twin's engine.

    Nothing of control or identification may see it.
    """

    def __init__(
        self,
        description: RigDescription,
        machine: Machine,
        wearer: Wearer | None,
        lengths: Mapping[str, float] | None = None,
        postures: Postures | None = None,
    ) -> None:
        """Build it.

        Args:
            description: Of the machine.
            machine: As it truly is.
            wearer: Who is in it.
            lengths: As for the twin: what the adjustable lengths are set to, by segment [m].
            postures: Other ones than the held-out [rad].
        """
        self._machine = machine
        self.postures = held_out_postures(description) if postures is None else postures
        """Where the machine truly is when it is scored [rad]."""

        self._full = build_scene(description, machine, wearer, lengths)
        self._full_statics = Statics(self._full, wearer, with_passive=False)
        self._weightless = build_scene(description, machine, wearer, lengths)
        _take_arm_mass(self._weightless)
        self._weightless_statics = Statics(self._weightless, wearer, with_passive=False)
        self._cache: dict[tuple[float, bool], Postures] = {}

    def lock_torque(self, q: Joints, payload_kg: float = 0.0, arm: bool = True) -> Joints:
        """Torque [N·m] on the locked joints at true positions `q`, the arm at rest in its cuffs, all else silent.

        Args:
            q: Of the machine's joints [rad].
            payload_kg: Hangs in the wearer's hand.
            arm: Whether the arm has mass; without it the cuffs are still strained.
        """
        scene, statics = (self._full, self._full_statics) if arm else (self._weightless, self._weightless_statics)
        if len(scene.arm):
            scene.hang("hand", payload_kg)
        return statics.settle(q)[1]

    def lock_torques(self, payload_kg: float = 0.0, arm: bool = True) -> Postures:
        """The same at all held-out postures; computed once."""
        key = (payload_kg, arm)
        if key not in self._cache:
            self._cache[key] = np.array([self.lock_torque(q, payload_kg, arm) for q in self.postures])
        return self._cache[key]

    def left_over(self, currents_of: CurrentsOf, payload_kg: float = 0.0) -> Postures:
        """Lock torque minus what the motors deliver, exoskeleton and arm together [N·m]: the headline score."""
        return self.lock_torques(payload_kg) - self.delivered(currents_of)

    def arm_left_over(self, arm_currents_of: CurrentsOf, payload_kg: float = 0.0) -> Postures:
        """The arm's share of the lock torque minus what the controller adds for the arm, as delivered [N·m]."""
        share = self.lock_torques(payload_kg) - self.lock_torques(arm=False)
        return share - self.delivered(arm_currents_of)

    def delivered(self, currents_of: CurrentsOf) -> Postures:
        """Torque [N·m] of the motors at the held-out postures, as the controller would command it there.

        The controller sees the positions through the encoders' offsets; their steps and all noise are left out.
        """
        drives, offset = self._machine.drives, self._machine.sensors.encoder_offset
        currents = currents_of(self.postures + offset)
        return np.clip(drives.gain * currents, -drives.torque_max, drives.torque_max)


def rms(left_over: Postures) -> Joints:
    """Root mean square over the postures, per joint [N·m]."""
    return np.sqrt(np.mean(left_over**2, axis=0))


def _take_arm_mass(scene: Scene) -> None:
    model = scene.model
    for arm in scene.arms:
        for body in arm.bodies:
            model.body_mass[body] = 0.0
            model.body_inertia[body] = 0.0
    # Statics needs no accelerations, but MuJoCo divides by the mass matrix on the way.
    model.dof_armature[:] = 1.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
