"""Static equilibrium of an arm in aligned cuffs: torque of the cuffs and torque of the weight.

    Σ_cuffs Jᵀ w = Y(z) φ,   for each freedom z of the arm, without passive torque

The unknown reaction forces at shoulder and elbow do no work on the freedoms and do not appear.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.cuff_wrench import cuff_torque
from exograv.dynamics.loop_torque import ArmExpression, static_load
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.interface import Joints, Rest
from exograv.model.assembly import Assembly
from exograv.model.loops import LoopSolver
from exograv.model.support import sample_postures

CANDIDATES = 32
"""Number of candidate postures in the task workspace."""

Freedoms = Float[np.ndarray, " freedom"]
Rows = Float[np.ndarray, "freedom phi"]


@dataclass(frozen=True)
class Balance:
    """Equilibrium of the arm's freedoms at one posture: `tau` = `Y` φ."""

    tau: Freedoms
    """Torque of the cuffs on the freedoms [N·m]."""

    Y: Rows
    """Torque per inertial parameter, ten columns per segment."""

    z: Freedoms
    """Arm angles, aligned and without sag [rad]."""


class RestStatics:
    """Statics of one arm in one machine."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        self.assembly, self.machine = assembly, machine
        self._solver = LoopSolver(assembly)
        self._kernel = kernel.compile(kernel.Recipe(_balance, (assembly, machine)))

    def balance(self, rest: Rest) -> Balance:
        """Equilibrium of the arm at a measured rest."""
        return self._at(rest.q, rest.wrenches)

    def weight_at(self, q: Joints) -> Balance:
        """Equilibrium at a posture `q` (joint,) [rad] without cuff forces: `Y` of the weight; `tau` is zero."""
        return self._at(q, np.zeros((len(self.assembly.cuffs), 6)))

    def candidates(self) -> Float[np.ndarray, "posture joint"]:
        """Postures spread over the task workspace [rad]."""
        return sample_postures(self.assembly.description, CANDIDATES)[1:]

    def _at(self, q: Joints, wrenches: Float[np.ndarray, "cuff 6"]) -> Balance:
        z, _ = self._solver.solve(q)
        tau, Y = self._kernel.of(q, z, wrenches.T)
        return Balance(tau, Y, z)


def _balance(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    layout = ParameterLayout.of(assembly)
    y, z = ca.SX.sym("y", assembly.n), ca.SX.sym("z", layout.freedoms)
    wrenches, phi = ca.SX.sym("wrenches", 6, len(assembly.cuffs)), ca.SX.sym("phi", layout.phi.stop)
    aligned, none = ca.SX.zeros(layout.fit.stop - layout.fit.start), ca.SX.zeros(layout.freedoms)
    weight = static_load(assembly, ArmExpression(phi, aligned, none, none, none), z, machine.gravity).torque
    outputs = [cuff_torque(assembly, y, z, aligned, wrenches), ca.jacobian(weight, phi)]
    return ca.Function("rest_balance", [y, z, wrenches], outputs, ["y", "z", "wrenches"], ["tau", "Y"])
