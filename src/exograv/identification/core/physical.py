"""Projection onto the nearest physically possible arm; every published estimate passes through it."""

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs

from exograv.model.tree import is_physical, pseudo_inertia

BARRIER_MIN = 1e-3
"""Final weight of −log det of the pseudo-inertia against half the squared distance [-].

The squared distance of a body exceeds the optimum by at most eight times this value. That is negligible: one standard
deviation counts 1.
"""

BARRIER_STEP = 10.0
STEPS_MAX = 50  # per barrier weight; about ten are needed
DECREMENT_MIN = 1e-6

(_posv,) = get_lapack_funcs(("posv",), dtype=np.float64)  # solution with a positive definite matrix

UNITS = np.array([pseudo_inertia(unit) for unit in np.eye(10)])
"""Pseudo-inertia of each unit parameter vector."""

Entries = Float[np.ndarray, " entry"]
Information = Float[np.ndarray, "entry entry"]


class PhysicalProjection:
    """Projection of the bodies in a parameter vector onto physically possible ones, in the metric of their covariance.

    Possible bodies form a convex cone and the distance is quadratic. Newton steps with a barrier at the cone's boundary
    therefore always converge, to a point inside. The other parameters move by their covariance with the bodies, as if
    the bodies had been measured there.

    Source: cone after Wensing, Kim, Slotine 2018, RA-L 3:60; barrier method after Boyd & Vandenberghe 2004, Convex
    Optimization, ch. 11.
    """

    def __init__(self, bodies: tuple[slice, ...], prior: Float[np.ndarray, " parameter"]):
        self._bodies = bodies
        self._entries = np.array([entry for body in bodies for entry in range(body.start, body.stop)], dtype=int)
        self._prior = prior[self._entries]

    def is_physical(self, x: Float[np.ndarray, " parameter"]) -> bool:
        """Return True if every body is physically possible."""
        return all(is_physical(x[body]) for body in self._bodies)

    def __call__(
        self, x: Float[np.ndarray, " parameter"], covariance: Float[np.ndarray, "parameter parameter"]
    ) -> Float[np.ndarray, " parameter"]:
        """Return the physically possible parameters nearest to `x`; `x` itself if it is possible."""
        if self.is_physical(x):
            return x
        entries = self._entries
        goal, moved = x[entries], self._prior
        information = np.linalg.inv(covariance[np.ix_(entries, entries)])
        # The barrier starts large: with a small one the first steps would be tiny.
        barrier = max(float((goal - moved) @ information @ (goal - moved)), BARRIER_MIN)
        while barrier > BARRIER_MIN:
            moved = _nearest_behind(barrier, moved, goal, information)
            barrier /= BARRIER_STEP
        moved = _nearest_behind(BARRIER_MIN, moved, goal, information)
        projected = x + covariance[:, entries] @ (information @ (moved - goal))
        projected[entries] = moved
        return projected


def _nearest_behind(barrier: float, phi: Entries, goal: Entries, information: Information) -> Entries:
    """Minimum of half the squared distance to `goal` minus `barrier` · Σ log det, from a possible `phi`."""
    for _ in range(STEPS_MAX):
        slope, curvature = _barrier_derivatives(phi)
        slope = information @ (phi - goal) + barrier * slope
        step = -_posv(information + barrier * curvature, slope)[1]
        decrement = max(float(-slope @ step) / barrier, 0.0)
        if decrement < DECREMENT_MIN:
            break
        # The function is self-concordant: a step of this length stays inside and descends.
        phi = phi + step / (1.0 + np.sqrt(decrement))
    return phi


def _barrier_derivatives(phi: Entries) -> tuple[Entries, Information]:
    """Gradient and Hessian of −Σ log det of the bodies' pseudo-inertias."""
    bodies = len(phi) // 10
    inverse = np.linalg.inv((phi.reshape(bodies, 10) @ UNITS.reshape(10, 16)).reshape(bodies, 4, 4))
    ratios = inverse[:, None] @ UNITS
    slope = -ratios[:, :, range(4), range(4)].sum(axis=2).ravel()
    turned = ratios.swapaxes(2, 3).reshape(bodies, 10, 16)
    curvature = np.zeros((bodies, 10, bodies, 10))
    each = np.arange(bodies)
    curvature[each, :, each] = ratios.reshape(bodies, 10, 16) @ turned.swapaxes(1, 2)
    return slope, curvature.reshape(len(phi), len(phi))
