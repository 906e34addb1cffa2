"""Cuffs of the twin: springs and dampers between limb and machine, as wrenches that act at one common point.

E = ½ e_pᵀ K_p e_p + ½ e_rᵀ K_r e_r,   e_p = R_exoᵀ (p_arm − p_exo),   e_r = ½ vee(Q − Qᵀ),   Q = R_exoᵀ R_arm
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.rig.twin.wearer.contact_cuffs import ContactCuffs
from exograv.rig.twin.wearer.strained_cuffs import StrainedCuffs
from exograv.rig.twin.wearer.wearer import Cuffs

from .scene import CuffPlace, Scene


@dataclass(frozen=True)
class Kinematics:
    """MuJoCo's own arrays as symbols, one column per body.

    MuJoCo is row-major, CasADi column-major, so the memory layout is the same.
    """

    xpos: ca.SX
    """Origins of the bodies (3, body) [m]."""

    xmat: ca.SX
    """Axes of the bodies (9, body), row by row."""

    xipos: ca.SX
    """Centres of mass (3, body) [m], at which `xfrc_applied` acts."""

    subtree_com: ca.SX
    """Centres of mass of subtrees (3, body) [m], the reference points of `cvel`."""

    cvel: ca.SX
    """Angular and linear velocity (6, body) [rad/s, m/s], the linear one at the tree's centre of mass."""

    @classmethod
    def of(cls, n_bodies: int) -> "Kinematics":
        """Return new symbols for `n_bodies` bodies."""
        return cls(
            xpos=ca.SX.sym("xpos", 3, n_bodies),
            xmat=ca.SX.sym("xmat", 9, n_bodies),
            xipos=ca.SX.sym("xipos", 3, n_bodies),
            subtree_com=ca.SX.sym("subtree_com", 3, n_bodies),
            cvel=ca.SX.sym("cvel", 6, n_bodies),
        )

    def axes(self, body: int) -> ca.SX:
        """Axes of a body, R_world_body (3, 3)."""
        return ca.reshape(self.xmat[:, body], 3, 3).T

    def velocity(self, body: int, root: int, point: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Angular velocity of a body, and linear velocity of its material point at `point` (3,) [rad/s, m/s]."""
        omega, linear = self.cvel[:3, body], self.cvel[3:, body]
        return omega, linear + ca.cross(omega, point - self.subtree_com[:, root])


@dataclass(frozen=True)
class CuffStates:
    """States that the cuffs of a foreign world carry from step to step; absent at home."""

    slipped: ca.SX | None = None
    """Way by which each cuff has slipped along the limb (cuff,) [m]."""

    lagged: ca.SX | None = None
    """Strain of the lagging flesh under each cuff, in the cuff's axes (3, cuff) [m]."""

    def of(self, number: int) -> "CuffStates":
        """Return the states of one cuff."""
        return CuffStates(
            None if self.slipped is None else self.slipped[number],
            None if self.lagged is None else self.lagged[:, number],
        )


NO_STATES = CuffStates()
"""States of cuffs that have not slipped and whose flesh does not lag."""


def cuff_wrenches(scene: Scene, cuffs: Cuffs, kinematics: Kinematics, states: CuffStates = NO_STATES) -> ca.SX:
    """Return forces and torques of all cuffs at the bodies' centres of mass (6, body) [N, N·m], world axes."""
    wrenches = ca.SX.zeros(6, scene.model.nbody)
    for number, place in enumerate(scene.cuffs):
        point, force, moment = _on_arm(scene, place, cuffs, kinematics, states.of(number))
        for body, sign in ((place.arm_body, 1.0), (place.exo_body, -1.0)):
            lever = point - kinematics.xipos[:, body]
            wrenches[:, body] += sign * ca.vertcat(force, moment + ca.cross(lever, force))
    return wrenches


def slip(
    scene: Scene, cuffs: Cuffs, strained: StrainedCuffs | ContactCuffs, kinematics: Kinematics, slipped: ca.SX
) -> ca.SX:
    """Return the way by which each cuff has slipped along the limb after this step (cuff,) [m]."""
    ways = []
    for number, place in enumerate(scene.cuffs):
        along = _offset(place, kinematics)[1][2]
        ways.append(strained.slipped(slipped[number], along, float(place.holds[2] * cuffs.stiffness[2])))
    return ca.vertcat(*ways)


def lag(scene: Scene, law: ContactCuffs, kinematics: Kinematics, lagged: ca.SX) -> ca.SX:
    """Return the strains of the lagging flesh under all cuffs after this step (3, cuff) [m]."""
    strains = []
    for number, place in enumerate(scene.cuffs):
        point, _ = _offset(place, kinematics)
        arm, exo = _velocities(scene, place, kinematics, point)
        # The machine's material point at the same place moves the axes of the offset: this is the offset's derivative.
        speed = kinematics.axes(place.exo_body).T @ (arm[1] - exo[1])
        strains.append(law.lagged(lagged[:, number], speed))
    return ca.horzcat(*strains)


def wrenches_at_cuffs(scene: Scene, cuffs: Cuffs, kinematics: Kinematics, states: CuffStates = NO_STATES) -> ca.SX:
    """Wrenches of all cuffs on the arm (6, cuff), as a sensor between machine and cuff measures them.

    Force, then moment about the origin of the machine's cuff frame, in that frame's axes [N, N·m].
    """
    columns = []
    for number, place in enumerate(scene.cuffs):
        point, force, moment = _on_arm(scene, place, cuffs, kinematics, states.of(number))
        R_exo = kinematics.axes(place.exo_body)
        lever = point - kinematics.xpos[:, place.exo_body]
        columns.append(ca.vertcat(R_exo.T @ force, R_exo.T @ (moment + ca.cross(lever, force))))
    return ca.horzcat(*columns)


def _offset(place: CuffPlace, kinematics: Kinematics) -> tuple[ca.SX, ca.SX]:
    """Return a cuff's point on the arm [m], and its offset from the machine's side in the cuff's axes [m] (3,)."""
    point = kinematics.xpos[:, place.arm_body] + kinematics.axes(place.arm_body) @ place.p_arm
    return point, kinematics.axes(place.exo_body).T @ (point - kinematics.xpos[:, place.exo_body])


def _on_arm(
    scene: Scene, place: CuffPlace, cuffs: Cuffs, kinematics: Kinematics, states: CuffStates
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Point of action [m], force [N] and moment [N·m] (3,) that a cuff exerts on the arm."""
    R_exo = kinematics.axes(place.exo_body)
    Q = R_exo.T @ kinematics.axes(place.arm_body) @ place.R_arm
    point, e_p = _offset(place, kinematics)
    if states.slipped is not None:
        e_p = e_p - ca.vertcat(0.0, 0.0, states.slipped)
    if cuffs.strained is not None:
        e_p = cuffs.strained.stretched(e_p)
    if states.lagged is not None and isinstance(cuffs.strained, ContactCuffs):
        e_p = e_p + cuffs.strained.lag_share * states.lagged
    e_r = 0.5 * ca.vertcat(Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1])
    # de_r = ½ (tr(Q) 1 − Q) dφ for a small turn dφ of the arm. Without the transpose of this factor, the moment would
    # not be the gradient of an energy.
    turn = 0.5 * (ca.trace(Q) * ca.SX.eye(3) - Q)
    stiffness = place.holds * cuffs.stiffness
    force = -R_exo @ (stiffness[:3] * e_p)
    moment = -R_exo @ (turn.T @ (stiffness[3:] * e_r))
    (omega_arm, v_arm), (omega_exo, v_exo) = _velocities(scene, place, kinematics, point)
    return (
        point,
        force - cuffs.damping * _held(place.holds[:3], R_exo, v_arm - v_exo),
        moment - cuffs.damping_rotation * _held(place.holds[3:], R_exo, omega_arm - omega_exo),
    )


def _velocities(
    scene: Scene, place: CuffPlace, kinematics: Kinematics, point: ca.SX
) -> tuple[tuple[ca.SX, ca.SX], tuple[ca.SX, ca.SX]]:
    """Angular and linear velocity of the arm, and of the machine, at a cuff's point [rad/s, m/s]."""
    roots = scene.model.body_rootid
    return (
        kinematics.velocity(place.arm_body, int(roots[place.arm_body]), point),
        kinematics.velocity(place.exo_body, int(roots[place.exo_body]), point),
    )


def _held(holds: Float[np.ndarray, " 3"], R_exo: ca.SX, motion: ca.SX) -> ca.SX:
    """Component of a relative motion (3,) that a cuff resists."""
    if holds.all():
        return motion
    return R_exo @ (ca.DM(holds) * (R_exo.T @ motion))
