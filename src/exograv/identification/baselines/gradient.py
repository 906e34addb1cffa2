"""Gradient method of the paper: one step of plain gradient descent on the squared torque error at every sample.

The arm model is the paper's: two rigid bodies in loops that close without misalignment, no elasticity, static and
Coulomb friction. The gradient is computed by automatic differentiation, in the loop, while the arm moves.
"""

from dataclasses import replace

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step
from exograv.dynamics.friction import friction_torque
from exograv.dynamics.loop_torque import ArmExpression, arm_load, exo_torque
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.identification.core.log_cholesky import phi_from_theta, theta_from_phi
from exograv.model.assembly import Assembly
from exograv.model.loops import LoopSolver

STEP = 1e-7
"""Step of the descent, the same for every parameter [1/(N·m)²].

It is the best of 1e-8 to 1e-4 on wearers 1000-1009 at level 2 that still reaches the target on 1000-1002 at level 0.
The paper's model has no elasticity, and larger steps bias the masses by it faster (docs/explanation/identification.md).
"""

V_MIDDLE = 0.3
"""Speed at which the paper's Coulomb friction also contains our viscous part [rad/s]: half of the usual peak speed."""


class Gradient:
    """Gradient descent of the paper (a `Method`); plain descent states no uncertainty."""

    name = "gradient"

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: Parameters, step: float = STEP):
        self._kernel = kernel.compile(kernel.Recipe(squared_error, (assembly, machine)), carry={"z_before": "z"})
        theta = ca.SX.sym("theta", 10)
        self._phi = kernel.compile(ca.Function("phi_of_theta", [theta], [phi_from_theta(theta)]))
        self._solver, self._layout = LoopSolver(assembly), ParameterLayout.of(assembly)
        self._step = step
        self._x = x.copy()
        self._theta = np.concatenate([theta_from_phi(x[body]) for body in self._layout.bodies])
        self._t: float | None = None

    def update(self, sample: Sample) -> None:
        """Make one step of the descent."""
        inputs = self._kernel.inputs
        if self._t is None:
            inputs["z_before"][:] = self._solver.solve(sample.q)[0]
        self._t = sample.t
        inputs["theta"][:] = self._theta
        inputs["q"][:] = sample.q
        inputs["v"][:] = sample.v
        inputs["a"][:] = sample.a
        inputs["tau_measured"][:] = sample.tau
        self._theta -= self._step * self._kernel()["gradient"]

    def estimate(self) -> Estimate:
        """Return the current parameters; the coordinates make them physically possible."""
        for body, theta in zip(self._layout.bodies, np.split(self._theta, len(self._layout.bodies)), strict=True):
            self._x[body] = self._phi.of(theta)[0]
        return Estimate(self._t or 0.0, self._x.copy(), None, 0.0, 1.0)


def squared_error(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    """Half the squared error between expected and measured torque, and its gradient.

    The measured torque enters as data, without a gradient. If it comes from the commanded torque it contains the
    feed-forward, and a gradient through the feed-forward would cancel the model.
    """
    n, layout = assembly.n, ParameterLayout.of(assembly)
    theta, z_before = ca.SX.sym("theta", layout.phi.stop), ca.SX.sym("z_before", layout.freedoms)
    q, v, a, tau_measured = (ca.SX.sym(name, n) for name in ("q", "v", "a", "tau_measured"))
    phi = ca.vertcat(*(phi_from_theta(theta[body]) for body in layout.bodies))
    aligned, none = ca.SX.zeros(layout.fit.stop - layout.fit.start), ca.SX.zeros(layout.freedoms)
    cuffs = cuff_energy(assembly)
    # With aligned shoulders the cuffs close without strain; at the loop's rate one Newton step per sample is enough.
    closed = closure(cuffs, q, newton_step(cuffs, q, z_before, aligned), aligned)
    motion = (q, v, a)
    arm = ArmExpression(phi, aligned, none, none, none)
    load = exo_torque(assembly, machine.phi, ca.DM(machine.rotor_inertia), motion, machine.gravity)
    load += closed.G.T @ arm_load(assembly, arm, cuffs, closed, motion, machine.gravity)
    coulomb = machine.friction.coulomb + V_MIDDLE * machine.friction.viscous
    paper = replace(
        machine.friction,
        coulomb=coulomb,
        viscous=np.zeros(n),
        load_share=np.zeros(n),
        asymmetry=np.zeros(n),
    )
    tau = load + friction_torque(paper, v, load)
    loss = 0.5 * ca.sumsqr(tau - tau_measured)
    outputs = [loss, ca.gradient(loss, theta), closed.z]
    names = ["theta", "q", "v", "a", "tau_measured", "z_before"]
    inputs = [theta, q, v, a, tau_measured, z_before]
    return ca.Function("squared_error", inputs, outputs, names, ["loss", "gradient", "z"])
