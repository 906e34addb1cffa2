"""Breakaway test: each joint is pushed from rest in both directions before any feedback is trusted.

Feedback with a flipped sign runs away; a push that grows until a joint moves does not. The torque at which the joint
starts to move is the breakaway friction.
"""

import numpy as np
from jaxtyping import Float

from exograv.control.native_law import NativeLaw
from exograv.dynamics.at_rest import carrying_torque, hanging_posture, weight_stiffness
from exograv.identification.calibration.empty_prior import COULOMB, usual_friction
from exograv.loop.tick_sample import TickSample
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.motion import hold
from exograv.signals import Reference

from .breakaway_checks import (
    MOVED,
    V_PUSHED,
    PushSamples,
    check_push,
    refuse_not_hanging,
    refuse_restless,
    refuse_shot,
    refuse_spring,
    refuse_too_light,
)
from .empty_run import EmptyRun
from .phase_texts import say

MARGIN = np.deg2rad(4.0)  # of the first posture from the joints' limits, so that a joint can be pushed both ways
PUSHES = 3  # in each direction; each ends some tenths of a degree farther, at another ripple of the gear
STARTED = 0.0015
"""Displacement at which a joint slides [rad]: more than stuck friction bends, and two steps of a bad encoder."""
RATE, KNOWN_RATE = 1.0, 1.5  # 1/s, of the usual and of a known Coulomb friction
# A push shorter than this could not show its current.
KNOWN = 0.5  # share of a known Coulomb friction at which a push starts
AGAIN = 0.4  # share of the last breakaway torque at which the next push starts
HELD = 0.4  # share of the usual Coulomb friction that holds on any day
PUSH_MAX = {"harmonic": 6.0, "quasi_direct": 8.0}
"""Largest push as a multiple of the usual Coulomb friction [-], limited to 0.9 of the motor's torque. It moves the
worst twins. Gear ripple counts for more in light drives."""
STILL_S, STILL_MAX, WAITS = 0.3, np.deg2rad(0.3), 10  # window [s], largest motion in it [rad], number of windows
CHUNK_S = 0.02

Joints = Float[np.ndarray, " joint"]


def starting_posture(tree: Tree) -> Joints:
    """Posture in which an empty machine is switched on (joint,) [rad]: hanging, so that it stays by itself."""
    return hanging_posture(tree, MARGIN)


def held_torque(description: RigDescription, tree: Tree) -> Joints:
    """Torque that untested motors must carry while the machine hangs (joint,) [N·m], by the URDF alone.

    Friction holds a joint that hangs. A joint that cannot hang because of its limit would fall and is carried.
    """
    weight = carrying_torque(tree, starting_posture(tree))
    return np.where(np.abs(weight) > HELD * usual_friction(description, COULOMB)[0], weight, 0.0)


def not_held(tree: Tree, q: Joints, held: Joints) -> Joints:
    """Torque (joint,) [N·m] that friction must hold at the reading `q` [rad] before any motion.

    Of a joint that rests near its limit, the starting posture is farther inside: `held` then lifts the joint to it, and
    friction must hold the joint either with `held` or, where it hangs by itself now, without.
    """
    weight = carrying_torque(tree, q)
    lower, upper = np.array([[joint.lower, joint.upper] for joint in tree.joints]).T
    is_near = (lower - MARGIN <= q) & (q <= upper + MARGIN)
    return np.where(is_near & (np.abs(weight) < np.abs(weight - held)), weight, weight - held)


class BreakawayPush:
    """Controller without feedback: carries the model's weight where friction would not, and pushes one joint."""

    closure_slope, clearance = 0.0, 1.0

    def __init__(self, held: Joints):
        self.tau_feedforward = held
        self.tau = held.copy()
        self.native_law = NativeLaw(self.tau, held)
        """This controller for a caller in C: its torque changes only between ticks."""

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return the push torque [N·m]; measurements are ignored."""
        return self.tau


class BreakawayTester:
    """Breakaway test of all joints of a machine that has not moved yet."""

    def __init__(self, run: EmptyRun, coulomb: Joints | None = None):
        """Check that the machine hangs.

        Args:
            run: Run of the empty machine.
            coulomb: Coulomb friction of a calibrated machine (joint,) [N·m]; the usual friction if None.

        Raises:
            ConfigError: By its encoders the machine does not hang.
        """
        self._run, self._joints = run, run.description.joints
        self._usual = usual_friction(run.description, COULOMB)[0]
        known = np.zeros(len(self._joints)) if coulomb is None else coulomb
        self._first, self._rate = KNOWN * known, np.maximum(RATE * self._usual, KNOWN_RATE * known)
        hanging, q = starting_posture(run.tree), run.pilot.q.copy()
        # No feedback here: a reversed encoder could make it drive the machine away.
        self._push = BreakawayPush(held_torque(run.description, run.tree))
        stiffness, held = weight_stiffness(run.tree, q), self._push.tau_feedforward
        refuse_not_hanging(run.description, hanging, q, not_held(run.tree, q, held), stiffness)
        self._stiffness = np.diag(stiffness)
        self._speed = 0.0
        self._stayed = dict[float, list[float]]()
        """Displacements that remained after a push [rad], by direction of the push."""
        most = np.array([PUSH_MAX[actuator.drive] for actuator in run.description.settings.actuators])
        self._most = np.minimum(most * self._usual, 0.9 * run.description.per_actuator("torque_max_Nm"))

    def nudge(self, pushes: int = PUSHES) -> Joints:
        """Push every joint both ways, and return the friction of each (joint,) [N·m].

        Raises:
            IdentificationError: A joint, its encoder or its motor is not what `rig.toml` says.
        """
        self._wait(say("calibration.still"))
        friction = np.zeros(len(self._joints))
        for joint, name in enumerate(self._joints):
            self._stayed = {}
            text = say("calibration.push", joint=name, number=joint + 1, of=len(self._joints))
            both_ways = [self._starts(joint, *way, text) for way in self._ways(joint, pushes)]
            refuse_spring(self._run.description, joint, self._stayed)
            refuse_too_light(self._run.description, joint, *both_ways)
            friction[joint] = np.mean([np.mean(one_way) for one_way in both_ways])
        return friction

    def _ways(self, joint: int, pushes: int) -> tuple[tuple[float, int], tuple[float, int]]:
        """Directions of the pushes and their numbers. A joint that lies on its stop is pushed off the stop first."""
        limits, q = self._run.tree.joints[joint], float(self._run.pilot.feedback.q[joint])
        if q > limits.upper:
            return (-1.0, pushes + 1), (1.0, pushes)
        if q < limits.lower:
            return (1.0, pushes + 1), (-1.0, pushes)
        return (1.0, pushes), (-1.0, pushes)

    def _starts(self, joint: int, sign: float, pushes: int, text: str) -> list[float]:
        """Push repeatedly in one direction, and return the torques along the push that moved the joint [N·m]."""
        found: list[float] = []
        for _ in range(pushes):
            first = AGAIN * max(found[-1], 0.0) if found else float(self._first[joint])
            found.append(self._start(joint, sign, first, text))
        return found

    def _start(self, joint: int, sign: float, first: float, text: str) -> float:
        """Push once from rest, and return the torque along the push that moved the joint [N·m]."""
        run = self._run
        pushed = self._ramp(joint, sign, first, text)
        if np.abs(pushed.way).argmax() != joint:
            # A joint at the edge of what its friction holds slips once at any touch; a swapped joint moves again.
            self._wait(text)
            pushed = self._ramp(joint, sign, first, text)
        check_push(run.description, joint, sign, pushed)
        self._wait(text)
        refuse_shot(run.description, joint, self._speed)
        if self._stiffness[joint] * 3 * MOVED < self._usual[joint]:
            # A joint that its weight may bring back is not checked for a spring.
            stayed = sign * float(run.filter.sample.q[joint] - pushed.q[0, joint])
            self._stayed.setdefault(sign, []).append(stayed)
        moved = int(np.argmax(sign * (pushed.q[:, joint] - pushed.q[0, joint]) > STARTED))
        run.note_start(float(pushed.t[moved]), joint, sign, pushed.q[moved], pushed.current[moved])
        return sign * float(run.description.nominal_gain[joint] * pushed.commanded[moved, joint])

    def _ramp(self, joint: int, sign: float, first: float, text: str) -> PushSamples:
        """Increase the push until a joint moves or the motor's limit is reached."""
        rig, push, run = self._run.pilot.rig, self._push, self._run
        rows: list[tuple[float, Joints, Joints, Joints]] = []
        q_start, way, size = run.pilot.feedback.q.copy(), np.zeros(len(self._joints)), first
        self._speed = 0.0

        def harder(moment: TickSample) -> None:
            nonlocal size
            self._listen(moment)
            if not size < self._most[joint]:
                return  # the push has ended
            sample = run.filter.sample
            commanded = run.pilot.actuators.current(moment.tau_commanded)
            rows.append((moment.state.t, sample.q.copy(), sample.tau.copy(), commanded))
            way[:] = moment.q - q_start
            # The filter would report the motion 40 ms late.
            size = np.inf if np.abs(way).max() > MOVED else size + self._rate[joint] * rig.period_s
            push.tau[joint] = push.tau_feedforward[joint] + (sign * size if size < self._most[joint] else 0.0)

        while size < self._most[joint]:
            run.pilot.run(push, hold(run.pilot.q.copy(), CHUNK_S, rig.period_s), text, harder)
        t, q, current, commanded = (np.array(column) for column in zip(*rows, strict=True))
        return PushSamples(t, q, current, commanded, way)

    def _wait(self, text: str) -> None:
        """Release the push, and wait until the machine has stood still for a while.

        Raises:
            IdentificationError: The machine moves by itself.
        """
        run, dt = self._run, self._run.pilot.rig.period_s
        self._push.tau[:] = self._push.tau_feedforward
        way = np.full(len(self._joints), np.inf)
        for _ in range(WAITS):
            q = run.filter.sample.q.copy()
            run.pilot.run(self._push, hold(run.pilot.q.copy(), STILL_S, dt), text, self._listen)
            way = run.filter.sample.q - q
            if self._speed > V_PUSHED or (run.filter.settled and np.abs(way).max() < STILL_MAX):
                return
        refuse_restless(run.description, way / STILL_S)

    def _listen(self, moment: TickSample) -> None:
        self._run.listen(moment)
        self._speed = max(self._speed, float(np.abs(moment.v).max()))
