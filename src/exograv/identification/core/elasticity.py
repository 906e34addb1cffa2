"""Elasticity of a relaxed joint as two exponentials: soft in the middle of its range, stiff at both ends."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Freedoms = Float[np.ndarray, " freedom"]
Curves = Float[np.ndarray, " curve"]

CURVATURE = 1.0
"""Start value of both exponents [1/rad]: stiffness grows by a half at one radian from the middle."""

SD = np.array([0.7, 0.5, 0.7, 0.5, 0.3])
"""Prior standard deviation of the five curve parameters [-, 1/rad, -, 1/rad, N·m]; the ridge is scaled by it."""


@dataclass(frozen=True)
class DoubleExponential:
    """Torque that holds each freedom at angle z against its elasticity, from five parameters per freedom.

        τ = exp(p₁ + p₂ z) − exp(p₃ − p₄ z) + p₅

    The five parameters of one freedom are adjacent. Source: Riener & Edrich 1999, J Biomech 32:539; used to
    identify a wearer in an exoskeleton: Li et al. 2022, IEEE TMRB 4:206.
    """

    freedoms: int

    def start(self, stiffness: Freedoms, offset: Freedoms) -> Curves:
        """Curve parameters whose torque near the neutral angle is stiffness · z − offset [N·m]."""
        neutral = offset / stiffness
        size = np.log(0.5 * stiffness / CURVATURE)
        slope = np.full(self.freedoms, CURVATURE)
        columns = [size - slope * neutral, slope, size + slope * neutral, slope, np.zeros(self.freedoms)]
        return np.column_stack(columns).ravel()

    @property
    def sd(self) -> Curves:
        """Prior standard deviation of all curve parameters."""
        return np.tile(SD, self.freedoms)

    def tangent(self, p: Curves, z: Freedoms) -> tuple[Freedoms, Freedoms]:
        """Stiffness [N·m/rad] and offset [N·m] of the tangent to the curves at `z` [rad]."""
        up, down, shift = self._parts(p, z)
        numbers = p.reshape(self.freedoms, 5)
        stiffness = numbers[:, 1] * up + numbers[:, 3] * down
        return stiffness, stiffness * z - (up - down + shift)

    def torque(self, p: Curves, z: Freedoms) -> Freedoms:
        """Elastic torque by the formula above [N·m]."""
        up, down, shift = self._parts(p, z)
        return up - down + shift

    def by_numbers(self, p: Curves, z: Freedoms) -> Float[np.ndarray, "freedom curve"]:
        """Return the derivative of the torque with respect to the curve parameters."""
        up, down, _ = self._parts(p, z)
        blocks = np.column_stack([up, z * up, -down, z * down, np.ones(self.freedoms)])
        derivative = np.zeros((self.freedoms, 5 * self.freedoms))
        for i, block in enumerate(blocks):
            derivative[i, 5 * i : 5 * i + 5] = block
        return derivative

    def straightened(self, p: Curves, z: Float[np.ndarray, "sample freedom"]) -> tuple[Freedoms, Freedoms]:
        """Stiffness [N·m/rad] and offset [N·m] of the least-squares lines over the visited angles `z` [rad]."""
        torque = np.array([self.torque(p, row) for row in z])
        centred = z - z.mean(axis=0)
        power = np.maximum((centred**2).sum(axis=0), 1e-12)
        stiffness = (centred * torque).sum(axis=0) / power
        return stiffness, stiffness * z.mean(axis=0) - torque.mean(axis=0)

    def _parts(self, p: Curves, z: Freedoms) -> tuple[Freedoms, Freedoms, Freedoms]:
        numbers = p.reshape(self.freedoms, 5)
        up = np.exp(numbers[:, 0] + numbers[:, 1] * z)
        down = np.exp(numbers[:, 2] - numbers[:, 3] * z)
        return up, down, numbers[:, 4]
