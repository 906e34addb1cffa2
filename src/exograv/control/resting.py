"""Torque of the control law at rest, for many postures and arms at once; for planning, checks and uncertainty."""

from dataclasses import dataclass, fields

import casadi as ca
import numpy as np
from jaxtyping import Bool, Float

from exograv import kernel
from exograv.dynamics.closure import PIVOT_MIN
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.model.assembly import Assembly
from exograv.model.loops import TWIST_COSINE_MIN, LoopSolver

from .tick import NEWTON_STEPS, SETTLED_SLOPE, SLOPE_MAX, ControlMode, tick_function

Postures = Float[np.ndarray, "state joint"]
Arms = Float[np.ndarray, "state parameter"]
Freedoms = Float[np.ndarray, "state freedom"]

STAGES = (4, 16)
"""Numbers of continuation steps to an arm's parameters if Newton's method fails on the direct way [-]. A shoulder
offset of 2 cm, or the weight of an arm whose roll is held softly, turns freedoms by up to 30°."""


@dataclass(frozen=True)
class Resting:
    """Result at rest, one row per state."""

    tau_desired: Postures
    """Motor torque that the control law asks for at rest [N·m]."""

    tau_arm: Postures
    """Part of the desired torque that carries the arm [N·m]."""

    z: Freedoms
    """Closed posture of the arm [rad]."""

    is_closed: Bool[np.ndarray, " state"]
    """True if the posture was found; otherwise the torques are invalid."""


class RestingTorque:
    """Batch of ticks without motion; Newton's method closes all postures at the same time."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        self._n = assembly.n
        self._batch = kernel.compile(kernel.Recipe(_resting_function, (assembly, machine)), lanes=0, shared=("mode",))
        self._solver, self._layout, self._arm = LoopSolver(assembly), ParameterLayout.of(assembly), assembly.arm
        self._bound: dict[int, kernel.BoundBatch] = {}

    def __call__(
        self, q: Postures, x: Arms, z_start: Freedoms, mode: ControlMode | None = None, x_start: Arms | None = None
    ) -> Resting:
        """Compute the torques at rest.

        Args:
            q: Measured joint positions [rad].
            x: Parameters, in the order of `dynamics.parameters`.
            z_start: Arm angles near the closed postures [rad]; `cold_start` finds them.
            mode: Gravity level and share of the arm; those of floating if None.
            x_start: Parameters for which `z_start` is closed; if None, `x` without weight, as in `cold_start`.
        """
        mode = mode or ControlMode()
        found = self._settled(q, x, z_start, mode)
        begin = self.weightless(x) if x_start is None else x_start
        for stages in STAGES:
            lost = np.flatnonzero(~found.is_closed)
            if not len(lost):
                break
            first, way = begin[lost], x[lost] - begin[lost]
            led = self._settled(q[lost], first + way / stages, z_start[lost], mode)
            for share in np.arange(2, stages + 1) / stages:
                led = self._settled(q[lost], first + share * way, led.z, mode)
            for field in fields(Resting):
                getattr(found, field.name)[lost[led.is_closed]] = getattr(led, field.name)[led.is_closed]
        return found

    def weightless(self, x: Arms) -> Arms:
        """Return the same arms without mass; their closed postures depend on the cuffs alone."""
        light = x.copy()
        light[:, self._layout.phi] = 0.0
        return light

    def _settled(self, q: Postures, x: Arms, z_start: Freedoms, mode: ControlMode) -> Resting:
        """Close the postures by Newton's method directly from `z_start`."""
        bound = self._memory(len(q))
        inputs, outputs = bound.inputs, bound.outputs
        inputs["q"][...], inputs["x"][...] = q.T, x.T
        inputs["mode"][:] = mode.gravity_level, mode.arm_share
        outputs["z"][...] = z_start.T
        for _ in range(NEWTON_STEPS + 1):
            inputs["z_before"][...] = outputs["z"]
            bound()
            if outputs["slope"].max() < SETTLED_SLOPE:
                break
        z = outputs["z"].T.copy()
        held = (outputs["slope"][0] < SLOPE_MAX) & (outputs["pivot"][0] > PIVOT_MIN)
        untwisted = (outputs["cosine"][0] > TWIST_COSINE_MIN) & self._arm.is_reachable(z)
        return Resting(outputs["tau_desired"].T.copy(), outputs["tau_arm"].T.copy(), z, held & untwisted)

    def cold_start(self, q: Postures, x: Parameters) -> Freedoms:
        """Solve for the closed postures of the cuffs alone [rad], from which Newton's method starts."""
        return self._solver.solve_many(q, x[self._layout.fit])

    def _memory(self, size: int) -> kernel.BoundBatch:
        if size not in self._bound:
            self._bound = {size: self._batch.bind(size)}
        return self._bound[size]


def _resting_function(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    """Tick function with all motion set to zero, which removes the terms of motion from the program."""
    n, freedoms = assembly.n, assembly.n_freedoms
    q, x, z_before = (
        ca.SX.sym("q", n),
        ca.SX.sym("x", ParameterLayout.of(assembly).count),
        ca.SX.sym("z_before", freedoms),
    )
    mode, still = ca.SX.sym("mode", 2), ca.SX.zeros(n)
    all_of_mode = ca.vertcat(0, mode)
    no_payload = ca.SX.zeros(ParameterLayout.of(assembly).phi.stop)
    tick = tick_function(assembly, machine)
    no_motion = [q, still, q, still, still, x, all_of_mode, q, z_before, ca.SX.zeros(freedoms, n), still, 1]
    arguments = [*no_motion, no_payload, ca.SX.ones(len(assembly.arm.limbs))]
    results = dict(zip(tick.name_out(), tick.call(arguments), strict=True))
    wanted = ["tau_desired", "tau_arm", "z", "slope", "pivot", "cosine"]
    names = ["q", "x", "z_before", "mode"]
    return ca.Function("resting", [q, x, z_before, mode], [results[name] for name in wanted], names, wanted)
