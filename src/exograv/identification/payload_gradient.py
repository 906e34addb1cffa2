"""The paper's method for a payload: at every sample, one step of plain gradient descent on the squared torque error."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.model.tree import inertial_parameters

from .interface import Estimate, Parameters, Sample
from .log_cholesky import phi_from_theta, theta_from_phi
from .payload import MASS_SD, NOTHING, PAYLOAD, PayloadModel, about_body, robot_torque

TRIAL_LOAD = inertial_parameters(MASS_SD, np.full(3, 0.1), 0.02 * np.eye(3))
"""What the rehearsal hangs on the unloaded robot: as heavy as the prior expects, a hand's breadth off the frame."""

SHARES_OF_STABLE = np.array([1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01])
"""Steps that are rehearsed, in shares of the largest that is stable for the trial load [-]."""

FOUND = 0.1  # share of the trial load's mass within which it counts as found


class PayloadGradient:
    """`Method`: it states no uncertainty, because plain descent has none."""

    name = "gradient"

    def __init__(self, model: PayloadModel, x: Parameters, step: float):
        """Start from nothing.

        Args:
            model: Robot and payload frame.
            x: The robot by its unloaded log, payload included, which is not read.
            step: Of the descent, the same for all ten log-Cholesky parameters [1/(N·m)²].
        """
        self._kernel = kernel.compile(_squared_error(model))
        self._kernel.inputs["x"][:] = x
        self._x, self._step = x.copy(), step
        self._theta = theta_from_phi(NOTHING)
        self._t = 0.0

    def update(self, sample: Sample) -> None:
        """One step downhill."""
        self._t = sample.t
        self._theta -= self._step * self.slope_at(sample)

    def slope_at(self, sample: Sample) -> Float[np.ndarray, " 10"]:
        """Gradient of half the squared torque error of one sample [(N·m)²] with respect to theta."""
        inputs = self._kernel.inputs
        inputs["theta"][:] = self._theta
        inputs["q"][:] = sample.q
        inputs["v"][:] = sample.v
        inputs["a"][:] = sample.a
        inputs["tau_measured"][:] = sample.tau
        return self._kernel()["gradient"]

    def curvature_at(self, sample: Sample) -> float:
        """Largest eigenvalue of the error's Gauss–Newton Hessian at one sample [(N·m)²]."""
        self.slope_at(sample)
        derivative = self._kernel.outputs["derivative"]
        return float(np.linalg.eigvalsh(derivative @ derivative.T)[-1])

    def estimate(self) -> Estimate:
        """Where the descent is now; possible by its parameters."""
        self._kernel.inputs["theta"][:] = self._theta
        self._x[PAYLOAD] = self._kernel()["phi"]
        return Estimate(self._t, self._x.copy(), None, 0.0, 1.0)

    def restart(self, phi: Float[np.ndarray, " 10"], step: float) -> None:
        """From another body, with another step."""
        self._theta, self._step = theta_from_phi(phi), step


def rehearsed_step(model: PayloadModel, x: Parameters, unloaded: list[Sample]) -> float:
    """The step that finds a trial load soonest in a rehearsal on the unloaded log [1/(N·m)²].

    The trial load's torque is added to the measured one, so the rehearsal has this robot's motion, noise and model
    error, and the loaded log stays unseen: as good a step as can be had honestly.
    """
    loaded_x = x.copy()
    loaded_x[PAYLOAD] = TRIAL_LOAD
    bare_x = x.copy()
    bare_x[PAYLOAD] = 0.0
    rehearsal = []
    for s in unloaded:
        added = model.linearise(s, loaded_x)[0] - model.linearise(s, bare_x)[0]
        rehearsal.append(Sample(s.t, s.q, s.v, s.a, s.tau + added))
    descent = PayloadGradient(model, x, step=0.0)
    descent.restart(TRIAL_LOAD, 0.0)
    stable = 2.0 / max(descent.curvature_at(sample) for sample in rehearsal)
    steps = stable * SHARES_OF_STABLE
    return float(min(steps, key=lambda step: _found_after(descent, rehearsal, step)))


def _found_after(descent: PayloadGradient, rehearsal: list[Sample], step: float) -> tuple[float, float]:
    """Time until the trial load's mass stays found [s], infinite if never; and the error at the end, for ties."""
    descent.restart(NOTHING, step)
    found_t, error = rehearsal[0].t, np.inf
    for sample in rehearsal:
        descent.update(sample)
        error = abs(descent.estimate().x[0] / MASS_SD - 1.0)
        if not error <= FOUND:
            found_t = np.inf
        elif not np.isfinite(found_t):
            found_t = sample.t
    return found_t, error if np.isfinite(error) else np.inf


def _squared_error(model: PayloadModel) -> ca.Function:
    n = model.n_joints
    theta, x = ca.SX.sym("theta", 10), ca.SX.sym("x", model.n_parameters)
    q, v, a, tau_measured = (ca.SX.sym(name, n) for name in ("q", "v", "a", "tau_measured"))
    phi = phi_from_theta(theta)
    tau = robot_torque(model.tree, (q, v, a), x, ca.DM(about_body(model.frame)) @ phi, model.frame.body)
    loss = 0.5 * ca.sumsqr(tau - tau_measured)
    arguments = [theta, q, v, a, tau_measured, x]
    outputs = [ca.gradient(loss, theta), phi, ca.jacobian(tau, theta)]
    names = ["theta", "q", "v", "a", "tau_measured", "x"]
    return ca.Function("squared_error", arguments, outputs, names, ["gradient", "phi", "derivative"])
