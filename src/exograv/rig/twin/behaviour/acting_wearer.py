"""Wearer who acts: muscles move the arm along a wanted movement by anticipation, elasticity and delayed reflexes.

    tau = lag(anticipated(t) + reflex(t − delay) + hold) + stiffness · (q_wanted − q) + damping · (v_wanted − v)

The wearer knows the state of the own arm and the wanted movement, but never the machine's actions. The anticipated
torque is learned by practice (`practice`) or computed from a model of the own arm (`internal_model`); either may be
wrong.
"""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.motion import Trajectory
from exograv.rig.twin.disturbances.constant import constant
from exograv.rig.twin.machine.delays import passed

PerFreedom = Float[np.ndarray, " arm"]
Table = Float[np.ndarray, "tick arm"]


@dataclass(frozen=True)
class Nerves:
    """Parameters that are the same at every freedom."""

    reflex_share: float = constant(0.5, "-", "assumed", "below 1 the delay cannot make it unstable", 0.0, 0.9)
    """Ratio of the reflex torque to the elastic torque at the same error [-]."""

    delay: float = constant(
        0.06, "s", "source", "long-latency responses of shoulder, elbow and wrist come 50–100 ms after a perturbation, "
        "https://ir.lib.uwo.ca/brainpub/781/ (abstract)", 0.05, 0.1,
    )  # fmt: skip
    """Delay of the reflex [s]."""

    muscle_lag: float = constant(0.04, "s", "unverified", "models of the arm use 30–60 ms", 0.03, 0.06)
    """Time constant from the command to the torque of a muscle [s]."""

    hold_rate: float = constant(
        1.0, "1/s", "assumed", "holding torque is an integral of error: Albert et al. (2020), eLife 9:e52507",
        0.3, 2.0,
    )  # fmt: skip
    """Rate at which a lasting error increases the holding torque, relative to the stiffness [1/s]."""

    hold_threshold: float = constant(
        float(np.deg2rad(0.8)), "rad", "source", "joint-angle SD of proprioception 0.6–1.1°, van Beers et al. (1998)",
        float(np.deg2rad(0.6)), float(np.deg2rad(1.1)),
    )  # fmt: skip
    """Error below which no error is felt, so that the holding torque does not change [rad]."""


@dataclass(frozen=True)
class Physiology:
    """Muscles and nerves of one arm, one entry per freedom, except in `Nerves`."""

    stiffness: PerFreedom
    """Immediate stiffness of contracted muscles against deviations from the wanted path [N·m/rad]."""

    damping: PerFreedom
    """Damping of contracted muscles against speed errors [N·m·s/rad]."""

    torque_max: PerFreedom
    """Greatest muscle torque [N·m]."""

    nerves: Nerves = field(default_factory=Nerves)


# Stiffness of shoulder and elbow in posture and reaching: some 10–30 N·m/rad, growing with torque (Gomi & Osu 1998, J
# Neurosci 18:8965, abstract; the numbers are unverified). Rotation, roll and wrist are assumed, by moment of inertia.
# Strength: static flexion 69–90 N·m in men, half of it in women ("Dynamic shoulder flexion strength for use in
# occupational risk analysis", abstract); elbow and shoulder 40–60 N·m, unverified; the others assumed.
USUAL = {
    "flexion": (20.0, 2.5, 60.0),
    "abduction": (20.0, 2.5, 40.0),
    "rotation": (12.0, 1.0, 30.0),
    "elbow": (14.0, 1.2, 50.0),
    "forearm_roll": (1.5, 0.08, 8.0),
    "wrist_flexion": (2.0, 0.10, 10.0),
    "wrist_deviation": (2.0, 0.10, 10.0),
}
"""Stiffness [N·m/rad], damping [N·m·s/rad] and strength [N·m] by freedom of the arm."""


def usual_physiology(freedoms: int) -> Physiology:
    """Return the physiology of an arm with the first 4 to 7 freedoms of `USUAL`, or of two such arms."""
    of_one = freedoms if freedoms <= len(USUAL) else freedoms // 2
    stiffness, damping, torque_max = np.array(list(USUAL.values())[:of_one] * (freedoms // of_one)).T
    return Physiology(stiffness, damping, torque_max)


class ActingWearer:
    """Wearer who wants a movement and produces its torque, one `step` per period, for `Twin.tau_voluntary`."""

    def __init__(self, physiology: Physiology, period_s: float):
        """Start relaxed: no wanted movement and no torque."""
        self.physiology, self._period = physiology, period_s
        self._step = kernel.compile(step_function(physiology, period_s), carry=CARRIED)
        self._inputs, self._evaluate, self._tau = self._step.inputs, self._step.evaluate, self._step.outputs["tau"]
        self._inputs["tension"][:] = 1.0
        self._table: Table | None = None
        self._begin = 0.0
        self.trusts_anticipation = False
        """True while a movement is learned.

        Lasting errors are then corrected by the anticipated torque. Two mechanisms that learn the same would
        counteract.
        """

    @property
    def hold(self) -> PerFreedom:
        """Learned holding torque (arm,) [N·m]."""
        return self._inputs["hold"].copy()

    @hold.setter
    def hold(self, tau: PerFreedom) -> None:
        self._inputs["hold"][:] = tau

    @property
    def tension(self) -> PerFreedom:
        """Co-contraction: stiffness and damping over those of `physiology` (arm,) [-]."""
        return self._inputs["tension"].copy()

    @tension.setter
    def tension(self, over_usual: PerFreedom) -> None:
        self._inputs["tension"][:] = over_usual

    @property
    def error(self) -> PerFreedom:
        """Wanted minus true position at the last step (arm,) [rad]."""
        return self._step.outputs["error"].copy()

    def want(self, movement: Trajectory, anticipated: Table, t: float) -> None:
        """Start a movement at time `t`; the last posture is kept after its end.

        Args:
            movement: Movement of the arm's freedoms, sampled at the wearer's period.
            anticipated: Torque that the wearer expects to need (tick, arm), or one row for all ticks [N·m].
            t: Start on the clock of `step` [s].
        """
        ticks, n = movement.q.shape
        table = np.empty((ticks + 1, 3 * n))
        table[:-1, :n], table[:-1, n : 2 * n], table[:-1, 2 * n :] = movement.q, movement.v, anticipated
        table[-1] = table[-2]
        table[-1, n : 2 * n] = 0.0
        self._table, self._begin = table, t

    def step(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] at time `t` [s] with the arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        table, inputs = self._table, self._inputs
        if table is None:
            return np.zeros_like(q_arm)
        inputs["wanted"][:] = table[min(max(round((t - self._begin) / self._period), 0), len(table) - 1)]
        inputs["q"][:], inputs["v"][:] = q_arm, v_arm
        inputs["holds"][0] = not self.trusts_anticipation
        self._evaluate()
        return self._tau.copy()


CARRIED = {"late": "late_next", "hold": "hold_next", "active": "active_next"}
"""States of `step_function` that pass from one period to the next."""


def step_function(body: Physiology, period_s: float) -> ca.Function:
    """Build the function of one period of muscles and nerves.

    `wanted` holds position, velocity and anticipated torque. `late` holds past errors and elastic torques, one column
    per period, relative to what was wanted then. `holds` is 1, or 0 if the holding torque shall not change.
    """
    n, nerves = len(body.stiffness), body.nerves
    q, v, tension, hold, active = (ca.SX.sym(name, n) for name in ("q", "v", "tension", "hold", "active"))
    wanted, holds = ca.SX.sym("wanted", 3 * n), ca.SX.sym("holds")
    late = ca.SX.sym("late", 2 * n, max(1, round(nerves.delay / period_s)))
    q_wanted, v_wanted, anticipated = ca.vertsplit(wanted, n)
    stiffness, torque_max = ca.DM(body.stiffness), ca.DM(body.torque_max)

    def within_strength(tau: ca.SX) -> ca.SX:
        return ca.fmin(ca.fmax(tau, -torque_max), torque_max)

    error = q_wanted - q
    elastic = tension * (stiffness * error + ca.DM(body.damping) * (v_wanted - v))
    reported, late_next = passed(late, ca.vertcat(error, elastic))
    late_error, late_elastic = ca.vertsplit(reported, n)
    felt = late_error - ca.fmin(ca.fmax(late_error, -nerves.hold_threshold), nerves.hold_threshold)
    hold_next = within_strength(hold + holds * period_s * nerves.hold_rate * stiffness * felt)
    command = within_strength(anticipated + nerves.reflex_share * late_elastic + hold_next)
    active_next = active + (1.0 - np.exp(-period_s / nerves.muscle_lag)) * (command - active)
    inputs = {"q": q, "v": v, "wanted": wanted, "tension": tension, "holds": holds}
    inputs |= {"late": late, "hold": hold, "active": active}
    results = {"tau": within_strength(active_next + elastic), "error": error}
    results |= {"late_next": late_next, "hold_next": hold_next, "active_next": active_next}
    return ca.Function("acting", [*inputs.values()], [*results.values()], [*inputs], [*results])
