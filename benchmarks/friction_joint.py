"""One joint of the twin's machine with a forearm or a whole arm in a soft cuff: the world of friction_compensation.py.

Drive, gear, stiction, delays and encoder are the twin's own; observer and rate limit are the controller's.
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.control.observer import observer_function
from exograv.dynamics.friction import Friction
from exograv.dynamics.machine import CalibratedMachine
from exograv.rig.twin import Machine
from exograv.rig.twin.machine.delays import Delays, passed
from exograv.rig.twin.machine.drive import DRIVE_STATES, TAU_MOTOR, THETA, DriveInput, drive_step
from exograv.rig.twin.world.scene import TIMESTEP
from friction_candidates import Candidate, Known, Seen

SUBSTEPS = 2
DT = SUBSTEPS * TIMESTEP
RATE_MAX = 150.0  # N·m/s: the envelope's
OBSERVER_Hz = 30.0
HAND = ("tau", "q", "v", "stiffness", "damping")


@dataclass(frozen=True)
class Load:
    """What hangs on a joint; each about what recupera_like and an arm of 75 kg have."""

    link_inertia: float
    """[kg·m²]"""

    arm_inertia: float
    """[kg·m²]"""

    cuff_stiffness: float
    """Of the cuffs about the joint [N·m/rad]."""

    cuff_damping: float
    """[N·m·s/rad]"""

    link_weight: float
    """At horizontal [N·m]."""

    arm_weight: float
    """At horizontal [N·m]."""

    stiffness: float
    """Of the wearer's muscles [N·m/rad]."""

    damping: float
    """[N·m·s/rad]"""


LOADS = {
    1: Load(0.45, 0.50, 400.0, 4.0, 8.0, 9.5, 16.0, 2.0),  # shoulder abduction, arm bent
    3: Load(0.05, 0.08, 150.0, 1.5, 2.0, 2.9, 10.0, 1.0),  # elbow
}
"""By joint of the machine."""


@dataclass(frozen=True)
class Circumstances:
    """What may be otherwise than the controller believes."""

    warmth: float = 0.4
    """0 cold, 1 after a long run [-]."""

    estimate: float = 1.0
    """Friction as believed over friction as calibrated [-]."""

    left_over: float = 0.1
    """Of the weights [N·m]."""

    arm_share: float = 1.0
    """Of the arm's weight that the motor carries [-]."""


@dataclass(frozen=True)
class Trace:
    """What happened, a row a tick."""

    q: np.ndarray
    """Of the machine's joint [rad]."""

    q_arm: np.ndarray
    """[rad]"""

    v_arm: np.ndarray
    """[rad/s]"""

    tau_hand: np.ndarray
    """By the wearer, at the arm [N·m]."""

    tau_returned: np.ndarray
    """By the law [N·m]."""


@dataclass(frozen=True)
class Hand:
    """What the wearer's muscles do: a torque of their own, and elasticity about a wanted path; tables or numbers."""

    tau: np.ndarray | float = 0.0
    """[N·m]"""

    q: np.ndarray | float = 0.0
    """Wanted [rad]."""

    v: np.ndarray | float = 0.0
    """[rad/s]"""

    stiffness: float = 0.0
    """[N·m/rad]"""

    damping: float = 0.0
    """[N·m·s/rad]"""


class JointWorld:
    """A drawn machine's joint, its load, and a law."""

    def __init__(
        self, machine: Machine, known: CalibratedMachine, joint: int, candidate: Candidate, now: Circumstances
    ) -> None:
        self.machine, self.joint, self.load, self.now = machine, joint, LOADS[joint], now
        beliefs = _known(known, joint, self.load, now.estimate)
        delays = Delays.of(machine.sensors.delay)
        sizes = {
            "hand": len(HAND), "drive": len(DRIVE_STATES), "q": 1, "v": 1, "q_arm": 1, "v_arm": 1, "q_seen": 1,
            "v_seen": 1, "tau_before": 1, "commands": delays.to_motors, "measurements": delays.to_computer,
            "state": candidate.states,
        }  # fmt: skip
        before = {name: ca.SX.sym(name, size) for name, size in sizes.items()}
        after, tau_hand, tau_returned = self._tick(before, candidate, beliefs)
        results = {f"{name}_next": value for name, value in after.items()}
        results |= {"tau_hand": tau_hand, "tau_returned": tau_returned}
        function = ca.Function("joint", list(before.values()), list(results.values()), list(before), list(results))
        carried = {name: f"{name}_next" for name in after if before[name].numel() > 0}
        self._kernel = kernel.compile(function, carry=carried)
        self.start(0.0)

    def start(self, q: float) -> None:
        """At rest at `q` [rad], the arm hanging in its cuff, the motor carrying both."""
        load, memory = self.load, self._kernel.inputs
        for buffer in memory.values():
            buffer[...] = 0.0
        tau = self._weight(q)
        for name in ("q", "q_seen", "measurements"):
            memory[name][...] = q
        memory["q_arm"][...] = q - load.arm_weight * np.sin(q) / load.cuff_stiffness
        memory["drive"][TAU_MOTOR] = memory["commands"][...] = memory["tau_before"][...] = tau
        memory["drive"][THETA] = q + tau / self.machine.drives.gear_stiffness[self.joint]

    def run(self, ticks: int, hand: Hand) -> Trace:
        """So many ticks on."""
        inputs, outputs, evaluate = self._kernel.inputs, self._kernel.outputs, self._kernel.evaluate
        table = np.column_stack([np.broadcast_to(getattr(hand, name), ticks) for name in HAND])
        buffer, trace = inputs["hand"], np.empty((ticks, 5))
        seen = inputs["q"], inputs["q_arm"], inputs["v_arm"], outputs["tau_hand"], outputs["tau_returned"]
        for now, row in zip(table, trace, strict=True):
            buffer[:] = now
            evaluate()
            row[:] = [value.item() for value in seen]
        return Trace(*trace.T)

    def _weight(self, q: float) -> float:
        return (self.load.link_weight + self.now.arm_share * self.load.arm_weight) * np.sin(q) + self.now.left_over

    def _tick(
        self, before: dict[str, ca.SX], candidate: Candidate, known: Known
    ) -> tuple[dict[str, ca.SX], ca.SX, ca.SX]:
        """All that is carried, one period on; what the hand gives, and what the law returns."""
        after = {name: value for name, value in before.items() if name != "hand"}
        true = before["measurements"][0] if before["measurements"].numel() else before["q"]
        step = self.machine.sensors.encoder_step[self.joint]
        measured = ca.floor(true / step + 0.5) * step if step > 0.0 else true
        seen = observer_function(1, DT, OBSERVER_Hz)(measured, before["q_seen"], before["v_seen"])
        after["q_seen"], after["v_seen"] = seen
        carried = (self.load.link_weight + self.now.arm_share * self.load.arm_weight) * ca.sin(seen[0])
        seen = Seen(seen[0], seen[0] - before["q_seen"], seen[1], carried, DT)
        tau_returned, after["state"] = candidate.law(known, seen, before["state"])
        desired = carried + self.now.left_over + tau_returned
        step_max = RATE_MAX * DT
        change = ca.fmin(ca.fmax(desired - before["tau_before"], -step_max), step_max)
        after["tau_before"] = before["tau_before"] + change
        tau, q, v, stiffness, damping = ca.vertsplit(before["hand"])
        tau_hand = tau + stiffness * (q - before["q_arm"]) + damping * (v - before["v_arm"])
        for _ in range(SUBSTEPS):
            after = self._substep(after, tau_hand)
        return after, tau_hand, tau_returned

    def _substep(self, now: dict[str, ca.SX], tau_hand: ca.SX) -> dict[str, ca.SX]:
        load, machine, joint = self.load, self.machine, self.joint
        tau_asked, commands = passed(now["commands"].T, now["tau_before"])
        _, measurements = passed(now["measurements"].T, now["q"])
        asked = DriveInput(tau_asked, now["q"], now["v"], ca.SX(self.now.warmth))
        drive = drive_step(machine, joint, now["drive"], asked, TIMESTEP)
        cuff = load.cuff_stiffness * (now["q"] - now["q_arm"]) + load.cuff_damping * (now["v"] - now["v_arm"])
        # A rigid gear leaves the rotor's inertia to the link.
        rotor = machine.drives.rotor_inertia[joint] * np.isinf(machine.drives.gear_stiffness[joint])
        a = (drive.tau_joint - cuff - load.link_weight * ca.sin(now["q"])) / (load.link_inertia + rotor)
        a_arm = (tau_hand + cuff - load.arm_weight * ca.sin(now["q_arm"])) / load.arm_inertia
        v, v_arm = now["v"] + TIMESTEP * a, now["v_arm"] + TIMESTEP * a_arm
        moved = {"v": v, "v_arm": v_arm, "q": now["q"] + TIMESTEP * v, "q_arm": now["q_arm"] + TIMESTEP * v_arm}
        return now | moved | {"drive": drive.state_next, "commands": commands.T, "measurements": measurements.T}


def _known(machine: CalibratedMachine, joint: int, load: Load, estimate: float) -> Known:
    """One joint of a calibration, its friction wrong by a factor."""
    friction, sd = (_only(values, joint) for values in (machine.friction, machine.friction_sd))
    believed = replace(
        friction,
        coulomb=estimate * np.asarray(friction.coulomb),
        viscous=estimate * np.asarray(friction.viscous),
        load_share=estimate * np.asarray(friction.load_share),
    )
    return Known(believed, sd, float(machine.rotor_inertia[joint]), load.link_inertia, load.arm_inertia)


def _only(friction: Friction, joint: int) -> Friction:
    def of(name: str) -> np.ndarray:
        return np.asarray(getattr(friction, name))[joint : joint + 1]

    return Friction(
        coulomb=of("coulomb"),
        viscous=of("viscous"),
        breakaway=of("breakaway"),
        load_share=of("load_share"),
        asymmetry=of("asymmetry"),
        v_stribeck=of("v_stribeck"),
        v_rest=friction.v_rest,
    )
