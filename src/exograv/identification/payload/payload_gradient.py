"""Gradient method of the paper for a payload: one step of plain descent on the squared torque error per sample."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.identification.core.log_cholesky import phi_from_theta, theta_from_phi
from exograv.identification.core.setting import Setting

from .payload import NOTHING, PAYLOAD, PayloadModel, about_body, robot_torque
from .trial_load import SHARES_OF_STABLE, TRIAL_LOAD, found_after, with_trial_load


class PayloadGradient:
    """Gradient descent of the paper for a payload (a `Method`); plain descent states no uncertainty."""

    name = "gradient"

    def __init__(self, model: PayloadModel, x: Parameters, step: float):
        """Start from a negligible payload.

        Args:
            model: Model of the robot with the payload frame.
            x: All parameters, the robot's from its unloaded log; the payload's entries are not read.
            step: Step of the descent, the same for all ten log-Cholesky parameters [1/(N·m)²].
        """
        self._kernel = kernel.compile(_squared_error(model))
        self._kernel.inputs["x"][:] = x
        self._x, self._step = x.copy(), step
        self._theta = theta_from_phi(NOTHING)
        self._t = 0.0

    def update(self, sample: Sample) -> None:
        """Make one step of the descent."""
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
        """Return the current parameters; the coordinates make them physically possible."""
        self._kernel.inputs["theta"][:] = self._theta
        self._x[PAYLOAD] = self._kernel()["phi"]
        return Estimate(self._t, self._x.copy(), None, 0.0, 1.0)

    def restart(self, phi: Float[np.ndarray, " 10"], step: float) -> None:
        """Restart from another body, with another step."""
        self._theta, self._step = theta_from_phi(phi), step


def rehearsed_step(setting: Setting, unloaded: list[Sample]) -> float:
    """Step that finds a trial load soonest in a rehearsal on the unloaded log [1/(N·m)²]; see `trial_load`."""
    model: PayloadModel = setting.model  # pyright: ignore[reportAssignmentType] - by contract
    rehearsal = with_trial_load(setting, unloaded)
    descent = PayloadGradient(model, setting.mean, step=0.0)
    descent.restart(TRIAL_LOAD, 0.0)
    stable = 2.0 / max(descent.curvature_at(sample) for sample in rehearsal)
    steps = [stable * share for share in SHARES_OF_STABLE]
    return min(steps, key=lambda step: _found_after(descent, rehearsal, step))


def _found_after(descent: PayloadGradient, rehearsal: list[Sample], step: float) -> tuple[float, float]:
    descent.restart(NOTHING, step)
    return found_after(descent, rehearsal)


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
