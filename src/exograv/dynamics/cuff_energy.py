"""Elastic energy of the cuffs and its first two derivatives, by the geometry of the chain from cuff to cuff.

Each cuff closes a serial chain: from its exoskeleton frame along the machine to the base, and along the arm to its arm
frame. With all vectors in the exoskeleton's cuff frame, joint j turns the chain's end by w_j and moves it by l_j.
Joints of the machine count negatively. A joint k nearer to the beginning moves the later ones,
∂w_j/∂x_k = w_k × w_j and ∂l_j/∂x_k = w_k × l_j, so that

    ∂E/∂x_j       = f·l_j + m·w_j
    ∂²E/∂x_j∂x_k  = l_j·K l_k + w_j·M w_k + w_k·(l_j × f + w_j × m)

with f the cuff's force, m its moment and M the moment's derivative by a rotation. Automatic differentiation of the
energy gives the same up to rounding, with twice as many instructions.
"""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from exograv.model.assembly import Assembly
from exograv.model.kinematics import NO_HINGES, Hinges, body_poses, joint_axis
from exograv.model.loops import (
    CuffPair,
    arm_hinges,
    arm_poses,
    arm_positions,
    cuff_pairs,
    fit_names,
    scaled_stiffness,
)
from exograv.model.tree import Tree
from exograv.spatial import Transform, cosine_of, rotation_residual, skew


@dataclass(frozen=True)
class CuffEnergy:
    """Elastic energy of the cuffs and its derivatives, on expressions of y (joint,), z (freedom,) and fit (fit,)."""

    y: ca.SX
    z: ca.SX
    fit: ca.SX
    moved: ca.SX
    """Displacement of each cuff's rest place on the machine (3, cuff), in the cuff's axes [m]: symbols or zero."""

    energy: ca.SX
    """Elastic energy E [J]."""

    slope: ca.SX
    """Gradient ∂E/∂z (freedom,) [N·m]."""

    strain: ca.SX
    """Gradient ∂E/∂y (joint,) [N·m] at fixed z."""

    H: ca.SX
    """Full Hessian ∂²E/∂z² (freedom, freedom) [N·m/rad]; JᵀKJ alone gives errors of G up to 0.3 if shoulders differ."""

    H_zy: ca.SX
    """Mixed derivative ∂²E/∂z∂y (freedom, joint) [N·m/rad]."""

    along: ca.SX
    """Velocity of y, then of z (joint + freedom,) [rad/s]."""

    slope_bent: ca.SX
    """Second time derivative of ∂E/∂z (freedom,) [N·m/s²], at the constant velocity `along`."""

    stretch: ca.SX
    """Displacement of each cuff from its rest place (3, cuff), in the cuff's axes [m]."""

    cosine: ca.SX
    """Cosine of the most turned cuff's rotation [-]: near 1 in a true minimum, small if the arm lies twisted."""


@dataclass(frozen=True)
class _Link:
    """Joint of a cuff's chain, in the exoskeleton's cuff frame."""

    index: int
    """Index of the joint in its tree."""

    turn: ca.SX
    """Rotation w_j of the chain's end per joint position (3,) [rad/rad]; zero for a sliding joint."""

    move: ca.SX
    """Displacement l_j of the chain's end per joint position (3,) [m/rad or m/m]."""


@dataclass(frozen=True)
class _CuffLoad:
    """Load of one cuff at the chain's end, in the exoskeleton's cuff frame."""

    P: ca.SX
    """Displacement of the chain's end (3,) [m]."""

    Q: ca.SX
    """Rotation matrix of the chain's end (3, 3)."""

    k: ca.SX
    """Stiffness against displacement (3,) [N/m]."""

    k_rotation: ca.SX
    """Stiffness against rotation (3,) [N·m]."""

    @cached_property
    def energy(self) -> ca.SX:
        """Elastic energy that is stored in the cuff [J]."""
        return 0.5 * (ca.dot(self.f, self.P) + ca.dot(self.kappa, self.rho))

    @cached_property
    def f(self) -> ca.SX:
        """Derivative of the energy by a displacement (3,) [N]."""
        return self.k * self.P

    @cached_property
    def rho(self) -> ca.SX:
        """Residual of the rotation (3,) [-]."""
        return rotation_residual(self.Q)

    @cached_property
    def kappa(self) -> ca.SX:
        """Derivative of the energy by the residual (3,) [N·m]."""
        return self.k_rotation * self.rho

    @cached_property
    def B(self) -> ca.SX:
        """Derivative of the residual by a rotation (3, 3): a rotation w changes Q by w × Q."""
        return 0.5 * (ca.trace(self.Q) * ca.SX.eye(3) - self.Q)

    @cached_property
    def m(self) -> ca.SX:
        """Derivative of the energy by a rotation (3,) [N·m]."""
        return self.B.T @ self.kappa

    @cached_property
    def M(self) -> ca.SX:
        """Derivative of m by a rotation (3, 3) [N·m]."""
        stretched = self.B.T @ ca.diag(self.k_rotation) @ self.B
        return stretched - self.kappa @ self.rho.T - 0.5 * self.Q.T @ skew(self.kappa)

    def slope(self, link: _Link) -> ca.SX:
        """Return the derivative ∂E/∂x with respect to a joint position."""
        return ca.dot(self.f, link.move) + ca.dot(self.m, link.turn)

    def curvature(self, link: _Link, before: _Link) -> ca.SX:
        """Second derivative of E with respect to a joint and an earlier joint of the chain, or the same joint."""
        carried = ca.cross(link.move, self.f) + ca.cross(link.turn, self.m)
        stretched = ca.dot(link.move, self.k * before.move) + ca.dot(link.turn, self.M @ before.turn)
        return stretched + ca.dot(before.turn, carried)

    def moment_rates(self, turning: ca.SX, turning_rate: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Time derivatives of m, first and second, if the end turns at this rate [rad/s] and [rad/s²]."""
        Q_rate = skew(turning) @ self.Q
        B_rate = 0.5 * (ca.trace(Q_rate) * ca.SX.eye(3) - Q_rate)
        rho_rate = self.B @ turning
        kappa_rate = self.k_rotation * rho_rate
        M_rate_turned = (
            B_rate.T @ kappa_rate
            + self.B.T @ (self.k_rotation * (B_rate @ turning))
            - kappa_rate * ca.dot(self.rho, turning)
            - self.kappa * ca.dot(rho_rate, turning)
            - 0.5 * (Q_rate.T @ ca.cross(self.kappa, turning) + self.Q.T @ ca.cross(kappa_rate, turning))
        )
        return self.M @ turning, M_rate_turned + self.M @ turning_rate


def cuff_energy(assembly: Assembly, moved: ca.SX | None = None) -> CuffEnergy:
    """Energy E = ½ Σ k r² over all cuffs, with its derivatives.

    `moved` (3, cuff) are symbols for displacements of the cuffs' rest places [m]. Without them, the places are those
    where the cuffs were fastened.
    """
    n, tree = assembly.n, assembly.arm.tree
    y, z = ca.SX.sym("y", n), ca.SX.sym("z", assembly.n_freedoms)
    fit, along = ca.SX.sym("fit", len(fit_names(assembly))), ca.SX.sym("along", n + assembly.n_freedoms)
    x = arm_positions(assembly.arm, z, fit)
    J = ca.jacobian(x, z)
    u_y, u_z = along[:n], along[n:]
    u_x = J @ u_z
    exo, arm, hinges = body_poses(assembly.exo, y), arm_poses(assembly, z, fit), arm_hinges(assembly, fit)
    stiffness = ca.reshape(scaled_stiffness(assembly, fit), 6, -1)
    moved, stretch = ca.SX.zeros(3, len(assembly.cuffs)) if moved is None else moved, list[ca.SX]()
    energy, cosine, g_y, g_x, g_bent = (
        ca.SX(0),
        ca.SX(1),
        ca.SX.zeros(n),
        ca.SX.zeros(x.numel()),
        ca.SX.zeros(x.numel()),
    )
    H_xx, H_xy = ca.SX.zeros(x.numel(), x.numel()), ca.SX.zeros(x.numel(), n)
    for i, pair in enumerate(cuff_pairs(assembly, exo, arm, fit)):
        stretch.append(pair.T_exo_arm.p - moved[:, i])
        cuff = _CuffLoad(stretch[-1], pair.T_exo_arm.R, stiffness[:3, i], stiffness[3:, i])
        # Order of the chain: the machine from the cuff to the base, then the arm from the base to the cuff.
        machine = _links(assembly.exo, exo, pair, pair.exo_body, turned=-1.0)[::-1]
        limb = _links(tree, arm, pair, pair.arm_body, turned=1.0, hinges=hinges)
        energy += cuff.energy
        cosine = ca.fmin(cosine, cosine_of(cuff.Q))
        for link in machine:
            g_y[link.index] += cuff.slope(link)
        for j, link in enumerate(limb):
            g_x[link.index] += cuff.slope(link)
            for before in machine:
                H_xy[link.index, before.index] += cuff.curvature(link, before)
            for before in limb[: j + 1]:
                H_xx[link.index, before.index] += cuff.curvature(link, before)
        speeds = [*(u_y[link.index] for link in machine), *(u_x[link.index] for link in limb)]
        for link, bent in zip(limb, _bent_slopes(cuff, machine + limb, speeds)[len(machine) :], strict=True):
            g_bent[link.index] += bent
    H_xx = ca.tril2symm(ca.tril(H_xx))
    # The shoulder's shift is non-linear in the arm's posture: its second derivative matters under cuff forces.
    pull = ca.SX.sym("pull", x.numel())
    shift_slope = ca.gradient(ca.dot(pull, x), z)
    shift_turn, shift_bent = ca.jtimes(shift_slope, z, u_z), ca.jtimes(ca.jtimes(shift_slope, z, u_z), z, u_z)
    g_turn = H_xx @ u_x + H_xy @ u_y
    a_x = ca.jtimes(u_x, z, u_z)
    slope_bent = ca.substitute(shift_bent, pull, g_x) + 2 * ca.substitute(shift_turn, pull, g_turn)
    slope_bent += J.T @ (g_bent + H_xx @ a_x)
    H = J.T @ H_xx @ J + ca.substitute(ca.jacobian(shift_slope, z), pull, g_x)
    return CuffEnergy(
        y, z, fit, moved, energy, J.T @ g_x, g_y, H, J.T @ H_xy, along, slope_bent, ca.horzcat(*stretch), cosine
    )


def _bent_slopes(cuff: _CuffLoad, chain: list[_Link], speeds: list[ca.SX]) -> list[ca.SX]:
    """Second time derivative of ∂E/∂x of each joint at constant joint speeds.

    The recursion is as in inverse dynamics: outwards for the effect of earlier joints on a link, and back for the
    effect of later joints on the chain's end.
    """
    zero = ca.SX.zeros(3)
    turning, turning_rate, w_rates, w_bents = [zero], [zero], [], []
    for link, u in zip(chain, speeds, strict=True):
        # Angular velocity of the chain up to this joint, and its rate; ẇ_j = Ω × w_j.
        w_rates.append(ca.cross(turning[-1], link.turn))
        w_bents.append(ca.cross(turning_rate[-1], link.turn) + ca.cross(turning[-1], w_rates[-1]))
        turning.append(turning[-1] + u * link.turn)
        turning_rate.append(turning_rate[-1] + u * w_rates[-1])
    moving, moving_rate, l_rates, l_bents = zero, zero, [], []
    for j in reversed(range(len(chain))):
        w, move = chain[j].turn, chain[j].move
        # The earlier joints and this one rotate l_j; the later ones change its lever arm.
        l_rate = ca.cross(turning[j + 1], move) + ca.cross(w, moving)
        l_bent = ca.cross(turning_rate[j + 1], move) + ca.cross(turning[j + 1], l_rate)
        l_bent += ca.cross(w_rates[j], moving) + ca.cross(w, moving_rate)
        l_rates.insert(0, l_rate)
        l_bents.insert(0, l_bent)
        moving, moving_rate = moving + speeds[j] * move, moving_rate + speeds[j] * l_rate
    f_rate, f_bent = cuff.k * moving, cuff.k * moving_rate
    m_rate, m_bent = cuff.moment_rates(turning[-1], turning_rate[-1])
    return [
        ca.dot(f_bent, link.move) + 2 * ca.dot(f_rate, l_rates[j]) + ca.dot(cuff.f, l_bents[j])
        + ca.dot(m_bent, link.turn) + 2 * ca.dot(m_rate, w_rates[j]) + ca.dot(cuff.m, w_bents[j])
        for j, link in enumerate(chain)
    ]  # fmt: skip


def _links(
    tree: Tree, poses: list[Transform], pair: CuffPair, body: int, turned: float, hinges: Hinges = NO_HINGES
) -> list[_Link]:
    """Joints between the base and a body, starting at the base; `turned` is −1 if the chain passes them backwards."""
    R, p_end = pair.T_world_exo.R.T, pair.T_world_arm.p
    links = []
    while body >= 0:
        joint, pose = tree.joints[body], poses[body]
        axis = turned * (R @ (pose.R @ joint_axis(tree, body, hinges)))
        if joint.kind == "revolute":
            links.append(_Link(body, axis, ca.cross(axis, R @ (p_end - pose.p))))
        else:
            links.append(_Link(body, ca.SX.zeros(3), axis))
        body = joint.parent
    return links[::-1]
