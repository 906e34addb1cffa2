"""Support test with one person: the guard ramps the support, the person tries targets, and a sinking arm is rescued.

The arm is fully carried at first, and support decreases from there. An arm that sinks is fully carried again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.errors import RigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.procedures.rehabilitation.support_level.targets import TARGETS, TIME_S, ReachJudge, Target
from exograv.task.levels import slewing_s

from .weak_person import MOVE_S, ReachingPerson

Place = Float[np.ndarray, " 3"]

LOOK_TICKS = 20
"""Ticks between two evaluations of the fingertip."""

SETTLE_S = 0.5
"""Time after a ramp or a motion before the arm's position counts [s]."""

SINK_M = 0.12
"""Drop of the fingertip below its rest position at which the arm counts as sinking, and is carried again [m]."""

FALL_M_S = 0.8
"""Downward speed of a fingertip that counts as falling. The return from the highest target has 0.5 at `MOVE_S`."""

ASTRAY_M = 0.10
"""Largest distance from the rest position before an attempt. Beyond, the person cannot hold the arm at rest."""


@dataclass(frozen=True)
class Attempt:
    """Attempt at one target."""

    target: int
    support: float
    """Share of the arm's weight that the machine carried [-]."""

    reached: bool
    nearest_m: float | None
    """Smallest distance to the target; None if the person could not hold the arm at rest."""

    rescued: bool
    """True if the machine took the whole weight again, because the arm sank."""


class SupportFlight:
    """Run of the machine with the attempts. It knows the arm only by the controller's estimate."""

    def __init__(self, pilot: Pilot, controller: ArmController, person: ReachingPerson, side: str):
        """Move the floating arm to rest. The pilot's guard must have the person's limits.

        Raises:
            RigError: The guard has no person's limits. The following methods raise it if the envelope stops the
                run.
        """
        self._pilot, self._controller, self._person = pilot, controller, person
        self._ticks, self._tip, self._begin = 0, np.zeros(3), pilot.rig.t
        self._rest_tip: Place | None = None
        self._rescued = False
        self.rescues = 0
        if pilot.envelope.person is None:
            raise RigError(
                "The guard does not know who is in the machine. Give it the person's limits before the support changes."
            )
        pilot.begin("go to rest")
        person.go_to(person.rest)
        self._run(2.0 * MOVE_S)
        self._rest_tip = self._tip.copy()
        self.places = tuple(target_places(np.array(controller.skeleton(pilot.q)[1]), side))
        """Places of the targets in the base frame, for this arm by the controller's model [m]."""

    @property
    def support(self) -> float:
        """Share of the arm's weight that the machine carries now [-]."""
        person = self._pilot.envelope.person
        return 1.0 - (0.0 if person is None else person.gravity_level)

    @property
    def seconds(self) -> float:
        """Time since the start of the test [s]."""
        return self._pilot.rig.t - self._begin

    @property
    def clipped_share(self) -> float:
        """Share of the ticks in which the guard limited torque or its rate [-]."""
        return self._pilot.envelope.clipped_ticks / max(self._ticks, 1)

    def attempt(self, target: int, support: float) -> Attempt:
        """Ramp the support to this share by the guard, let the person try, and return to rest."""
        self._note("reach_began", target, support, place_m=self.places[target].tolist())
        self._person.attempt()
        held = self._brought_to(support)
        judge = ReachJudge(self.places[target])
        if held:
            self._person.reach(self.places[target])
            self._run(TIME_S, lambda t: judge.see(t, self._tip) or self._rescued)
        result = Attempt(target, support, judge.reached, judge.nearest_m if held else None, self._rescued)
        self._note("reach_ended", target, support, reached=judge.reached, rescued=self._rescued)
        self._come_back()
        return result

    def carry_all(self) -> None:
        """Carry the whole weight again."""
        seconds = max(slewing_s(1.0 - self.support, 0.0), MOVE_S)
        self._feel(0.0)
        self._person.go_to(self._person.rest, seconds, 0.0)
        self._run(seconds + SETTLE_S)

    def _brought_to(self, support: float) -> bool:
        """Ramp the support. Return True if the person then holds the arm at rest."""
        level = 1.0 - support
        ramp_s = slewing_s(1.0 - self.support, level)
        if ramp_s > 0.0:
            self._feel(level)
            self._person.go_to(self._person.rest, max(ramp_s, SETTLE_S), level)
            self._run(ramp_s + SETTLE_S, lambda _t: self._rescued)
        astray = 0.0 if self._rest_tip is None else float(np.linalg.norm(self._tip - self._rest_tip))
        return not self._rescued and astray < ASTRAY_M

    def _come_back(self) -> None:
        if self._rescued:
            self.rescues += 1
            self.carry_all()
            self._rescued = False
        self._person.go_to(self._person.rest)
        self._run(MOVE_S + SETTLE_S, lambda _t: self._rescued)
        if self._rescued:
            self._come_back()

    def _run(self, seconds: float, done: Callable[[float], bool] = lambda _t: False) -> None:
        """Run for a time [s], or until `done`. The person acts, and the controller takes the guard's gravity level."""
        dt, ended = self._pilot.rig.period_s, False

        def act(moment: TickSample) -> None:
            nonlocal ended
            self._person.act()
            person = self._pilot.envelope.person
            if person is not None:
                self._controller.mode.gravity_level = person.gravity_level
            self._ticks += 1
            if self._ticks % LOOK_TICKS == 0:
                self._look(moment, dt)
                ended = done(moment.state.t)

        # The pilot needs a reference, but no feedback drives the machine to it here.
        slice_s = LOOK_TICKS * dt
        for _ in range(round(seconds / slice_s)):
            self._pilot.run(self._controller, motion.hold(self._pilot.q.copy(), slice_s, dt), "", act)
            if ended:
                break

    def _look(self, moment: TickSample, dt: float) -> None:
        """Compute the fingertip position by the controller's model. If the arm sinks, support it fully."""
        exo, arm = self._controller.skeleton(moment.q)
        before, self._tip = self._tip, np.array(arm[-1])
        if self._pilot.recording is not None:
            self._pilot.recording.write("/skeleton", moment.state.t, {"exo": exo, "arm": arm})
        if self._rescued or self._rest_tip is None or self.support == 1.0:
            return
        falls = (before[2] - self._tip[2]) / (LOOK_TICKS * dt)
        if falls > FALL_M_S or self._tip[2] < self._rest_tip[2] - SINK_M:
            self._rescued = True
            self._feel(0.0)

    def _feel(self, level: float) -> None:
        if not self._pilot.guard.feel(level):
            raise RigError("The guard refused a change of the support. The recording shows the reason.")

    def _note(self, kind: str, target: int, support: float, **more: object) -> None:
        recording = self._pilot.recording
        if recording is not None:
            record = {"kind": kind, "target": target, "targets": len(TARGETS), "support": support, **more}
            recording.write("/task", self._pilot.rig.t, {"kind": kind, "record": record})


def _length(arm: Float[np.ndarray, "point 3"]) -> float:
    """Length from the shoulder over elbow and wrist to the fingertip [m]."""
    return float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum())


def target_places(arm: Float[np.ndarray, "point 3"], side: str, targets: tuple[Target, ...] = TARGETS) -> list[Place]:
    """Return the places of the targets in the base frame [m]."""
    return [target.place(arm[0], _length(arm), side) for target in targets]
