"""Rigid-body algebra on CasADi expressions: rotations, cross products, small symmetric linear systems."""

from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class Transform:
    """Pose of one frame in another: `T_a_b` maps coordinates in b to coordinates in a."""

    R: ca.SX
    """Rotation (3, 3)."""

    p: ca.SX
    """Origin of b in a (3,) [m]."""

    def __matmul__(self, other: "Transform") -> "Transform":
        return Transform(self.R @ other.R, self.p + self.R @ other.p)

    def apply(self, point: ca.SX) -> ca.SX:
        """Coordinates (3,) in frame a of a point (3,) that is given in frame b [m]."""
        return self.p + self.R @ point

    def inverse(self) -> "Transform":
        """Inverse pose: `T_b_a` of `T_a_b`."""
        return Transform(self.R.T, -(self.R.T @ self.p))


def skew(w: ca.SX) -> ca.SX:
    """Matrix (3, 3) with `skew(w) @ u` = w × u."""
    return ca.vertcat(ca.horzcat(0, -w[2], w[1]), ca.horzcat(w[2], 0, -w[0]), ca.horzcat(-w[1], w[0], 0))


def rotation_about(axis: ca.DM | ca.SX, angle: ca.SX) -> ca.SX:
    """Rotation (3, 3) by `angle` about a unit `axis` (3,), by Rodrigues' formula."""
    K = skew(ca.SX(axis))
    return ca.SX.eye(3) + ca.sin(angle) * K + (1 - ca.cos(angle)) * (K @ K)


def rotation_residual(R: ca.SX) -> ca.SX:
    """Vector (3,) of the skew-symmetric part of R: axis times the sine of the angle, zero without rotation."""
    return 0.5 * ca.vertcat(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])


def cosine_of(R: ca.SX) -> ca.SX:
    """Cosine of the angle of a rotation R (3, 3)."""
    return 0.5 * (ca.trace(R) - 1)


def inertia_matrix(phi: ca.SX) -> ca.SX:
    """Inertia (3, 3) about the body's origin [kg·m²] from the inertial parameters (10,) of one body.

    phi = [m, m·cx, m·cy, m·cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz]; the order is Pinocchio's.
    """
    xx, xy, yy, xz, yz, zz = (phi[i] for i in range(4, 10))
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def solve_symmetric(H: ca.SX, b: ca.SX, pivot_min: float) -> tuple[ca.SX, ca.SX]:
    """Solution X (n, m) of H X = b for a symmetric positive definite H (n, n), and its smallest pivot.

    LDLᵀ without pivoting. A pivot below `pivot_min` is raised to `pivot_min`, which damps the solution near a
    singularity without a branch. The returned pivot shows the caller if that happened.
    """
    n = H.size1()
    L = ca.SX.eye(n)
    d = ca.SX.zeros(n)
    smallest = ca.SX(ca.inf)
    for j in range(n):
        pivot = H[j, j] - sum(L[j, k] ** 2 * d[k] for k in range(j))
        smallest = ca.fmin(smallest, pivot)
        d[j] = ca.if_else(pivot < pivot_min, pivot_min, pivot)
        for i in range(j + 1, n):
            L[i, j] = (H[i, j] - sum(L[i, k] * L[j, k] * d[k] for k in range(j))) / d[j]
    x = b
    for i in range(n):
        for k in range(i):
            x[i, :] -= L[i, k] * x[k, :]
    for i in range(n):
        x[i, :] /= d[i]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i, :] -= L[k, i] * x[k, :]
    return x, smallest
