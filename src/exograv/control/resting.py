"""What the control law asks for at rest, at many postures and for many arms at once: to plan, examine and doubt."""

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
"""In so many steps an arm is led to its parameters where Newton's method loses it on the direct way [-]. A shoulder
that is elsewhere by 2 cm, or the weight of an arm whose roll is held softly, turns freedoms by up to 30°."""


@dataclass(frozen=True)
class Resting:
    """One row a state."""

    tau_desired: Postures
    """[N·m]"""

    tau_arm: Postures
    """The arm's share of it [N·m]."""

    z: Freedoms
    """Closed posture of the arm [rad]."""

    is_closed: Bool[np.ndarray, " state"]
    """Whether the posture was found; where not, the torques mean nothing."""


class RestingTorque:
    """The tick without motion, as a batch: its postures are closed by Newton's method, all at the same time."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        self._n = assembly.n
        self._batch = kernel.compile(_resting_function(assembly, machine), lanes=0, shared=("mode",))
        self._solver, self._layout, self._arm = LoopSolver(assembly), ParameterLayout.of(assembly), assembly.arm
        self._bound: dict[int, kernel.BoundBatch] = {}

    def __call__(
        self, q: Postures, x: Arms, z_start: Freedoms, mode: ControlMode | None = None, x_start: Arms | None = None
    ) -> Resting:
        """Torques at rest.

        Args:
            q: Joint positions as measured [rad].
            x: Parameters, in the order of `dynamics.parameters`.
            z_start: Near the closed postures [rad]; `cold_start` finds them.
            mode: Gravity level and share of the arm; as while floating if none is given.
            x_start: Of the arms whose closed postures `z_start` are; `x` without weight, as in `cold_start`, if absent.
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
        """The same arms without mass: their closed postures are those of the cuffs alone."""
        light = x.copy()
        light[:, self._layout.phi] = 0.0
        return light

    def _settled(self, q: Postures, x: Arms, z_start: Freedoms, mode: ControlMode) -> Resting:
        """By Newton's method straight from `z_start`."""
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
        """Postures of the cuffs alone [rad]: where Newton's method finds the loaded ones from."""
        fit = x[self._layout.fit]
        return np.array([self._solver.solve(posture, fit=fit)[0] for posture in q])

    def _memory(self, size: int) -> kernel.BoundBatch:
        if size not in self._bound:
            self._bound = {size: self._batch.bind(size)}
        return self._bound[size]


def _resting_function(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    """The tick with everything that moves set to zero, so that what it costs falls away."""
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
