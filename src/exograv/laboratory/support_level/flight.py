"""One person in a flown machine: support let down and taken up by the guard's ramp, attempts at targets, and rescue.

The arm is fully carried at first. Support goes down from there, and whoever cannot hold what is left is carried again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.errors import RigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Pilot, TickSample
from exograv.procedures.rehabilitation.support_level.targets import TARGETS, TIME_S, ReachJudge, Target
from exograv.task.levels import slewing_s

from .weak_person import MOVE_S, ReachingPerson

Place = Float[np.ndarray, " 3"]

LOOK_TICKS = 20
"""Between two looks at where the fingertip is."""

SETTLE_S = 0.5
"""After a ramp or a way, before it counts where the arm is."""

SINK_M = 0.12
"""Lower than the fingertip at rest: the arm is not held any more, and is carried again."""

FALL_M_S = 0.8
"""A fingertip that comes down faster is falling; the way back from the highest target has 0.5 at `MOVE_S`."""

ASTRAY_M = 0.10
"""From the place at rest: who is not there before an attempt cannot hold the arm at rest."""


@dataclass(frozen=True)
class Attempt:
    """At one target, once."""

    target: int
    support: float
    """Share of the arm's weight that the machine carried [-]."""

    reached: bool
    nearest_m: float | None
    """None where the arm was not even held at rest."""

    rescued: bool
    """Whether the machine took the whole weight again, because the arm sank."""


class SupportFlight:
    """Flies the machine and counts; what it knows of the arm is what control knows."""

    def __init__(self, pilot: Pilot, controller: ArmController, person: ReachingPerson, side: str):
        """The pilot's guard knows whose arm it is; the arm is floating.

        Raises:
            RigError: The guard holds nobody's limits; so in all that follows where the envelope stops the run.
        """
        self._pilot, self._controller, self._person = pilot, controller, person
        self._ticks, self._tip, self._begin = 0, np.zeros(3), pilot.rig.t
        self._rest_tip: Place | None = None
        self._rescued = False
        self.rescues = 0
        if pilot.envelope.person is None:
            raise RigError("The guard does not know who is in the machine. Tell it before the support is changed.")
        pilot.begin("go to rest")
        person.go_to(person.rest)
        self._run(2.0 * MOVE_S)
        self._rest_tip = self._tip.copy()
        self.places = tuple(target_places(np.array(controller.skeleton(pilot.q)[1]), side))
        """Of the targets, in the base frame, for this arm as control knows it [m]."""

    @property
    def support(self) -> float:
        """Share of the arm's weight that is carried now [-]."""
        person = self._pilot.envelope.person
        return 1.0 - (0.0 if person is None else person.gravity_level)

    @property
    def seconds(self) -> float:
        """Since the test began [s]."""
        return self._pilot.rig.t - self._begin

    @property
    def clipped_share(self) -> float:
        """Of all ticks, in which the guard limited torque or its rate [-]."""
        return self._pilot.envelope.clipped_ticks / max(self._ticks, 1)

    def attempt(self, target: int, support: float) -> Attempt:
        """Bring the support to this share, by the guard's ramp, let the person try, and come back."""
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
        """Take the whole weight again."""
        seconds = max(slewing_s(1.0 - self.support, 0.0), MOVE_S)
        self._feel(0.0)
        self._person.go_to(self._person.rest, seconds, 0.0)
        self._run(seconds + SETTLE_S)

    def _brought_to(self, support: float) -> bool:
        """Whether the person holds the arm at rest with that."""
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
        """Fly so long, or until it is done; the person acts, and the guard's level is control's."""
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

        # Nothing drives the machine to a reference here: it only has to be there.
        slice_s = LOOK_TICKS * dt
        for _ in range(round(seconds / slice_s)):
            self._pilot.run(self._controller, motion.hold(self._pilot.q.copy(), slice_s, dt), "", act)
            if ended:
                break

    def _look(self, moment: TickSample, dt: float) -> None:
        """Where the fingertip is by control's model; an arm that sinks is carried again."""
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
            raise RigError("The guard does not let the support change. The recording shows why it holds the machine.")

    def _note(self, kind: str, target: int, support: float, **more: object) -> None:
        recording = self._pilot.recording
        if recording is not None:
            record = {"kind": kind, "target": target, "targets": len(TARGETS), "support": support, **more}
            recording.write("/task", self._pilot.rig.t, {"kind": kind, "record": record})


def _length(arm: Float[np.ndarray, "point 3"]) -> float:
    """From shoulder over elbow and wrist to the fingertip [m]."""
    return float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum())


def target_places(arm: Float[np.ndarray, "point 3"], side: str, targets: tuple[Target, ...] = TARGETS) -> list[Place]:
    """Base frame [m]."""
    return [target.place(arm[0], _length(arm), side) for target in targets]
