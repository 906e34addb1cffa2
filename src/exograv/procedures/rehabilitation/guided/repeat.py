"""Repetition of a taught path: the arm is led to its start and along it, unless the person resists or stops it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from exograv import motion
from exograv.loop.phases import FLOATING
from exograv.loop.tick_sample import ObservedMotion
from exograv.motion import Passage, Trajectory

from .floating_arm import rms_deg
from .grip import DROP_S, GRIP_S, GripOutcome
from .guided_arm import GuidedArm
from .path_guide import Anchor, PathGuide
from .pull import PullStrength

APPROACH_RAD_S = 0.4
"""Speed on the way to the start of the path, and back from its end [rad/s]."""

PATIENCE_S = 60.0
"""Time allowed beyond the duration of a path [s]. A person who holds against it for longer is released."""

REST_S = 1.0
"""Rest at the end of a path, before it is judged or repeated [s]."""


SETTLE_S = 3.0
"""Time in which a released arm comes to rest by its joints' own elasticity [s]."""


@dataclass(frozen=True)
class RepeatFigures:
    """Figures of a session that repeats a path."""

    repetitions: int
    outcome: GripOutcome
    tracking_rms_deg: list[float]
    waited_s: float
    pull_max_Nm: np.ndarray
    v_max_rad_s: float


@dataclass
class RepeatResult:
    """Result of a session that repeats a path."""

    repetitions: int = 0
    """Repetitions that were led to their end."""
    state: GripOutcome = GripOutcome.FREE
    waited_s: float = 0.0
    pull_max: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Largest torque by which each joint was pulled along the path [N·m]."""
    v_max: float = 0.0
    """Largest joint speed while the arm was held or led, estimated by the observer [rad/s]."""
    errors: list[np.ndarray] = field(default_factory=list)
    """Errors from the path while it was repeated, by the machine's encoders, one row per tick [rad]."""

    @property
    def figures(self) -> RepeatFigures:
        """Repetitions, error [°], waiting time [s], pull [N·m] and speed [rad/s], rounded for `--json`."""
        return RepeatFigures(
            repetitions=self.repetitions,
            outcome=self.state,
            tracking_rms_deg=rms_deg(self.errors),
            waited_s=round(self.waited_s, 2),
            pull_max_Nm=self.pull_max.round(3),
            v_max_rad_s=round(self.v_max, 2),
        )


def repeat(
    flown: GuidedArm,
    path: Trajectory,
    speed: float,
    repetitions: int,
    act: Callable[[], bool] = lambda: False,
    watch: Callable[[PathGuide], None] = lambda _guide: None,
) -> RepeatResult:
    """Lead the floating arm along the path `repetitions` times. It floats afterwards, whatever the outcome.

    Args:
        flown: Arm, floating.
        path: Path at its highest allowed speed.
        speed: Share of the path's own speed, 0.1 to 1.
        repetitions: Repetitions, at least 1.
        act: Called in every tick, to act beside the machine; True if the arm must be released.
        watch: Called in every tick while the arm is led, to examine the guide.

    Raises:
        RigError: The envelope stopped the run.
    """
    return _Session(flown, act, watch).repeat(path, speed, repetitions)


class _Session:
    """State of one session: callbacks and the result so far."""

    def __init__(self, flown: GuidedArm, act: Callable[[], bool], watch: Callable[[PathGuide], None]):
        self._flown, self._act, self._watch = flown, act, watch
        self._strength = PullStrength.of(flown.description)
        self._done, self._wants_out = RepeatResult(pull_max=np.zeros(len(flown.q))), False

    def repeat(self, path: Trajectory, speed: float, repetitions: int) -> RepeatResult:
        flown, done = self._flown, self._done
        flown.begin(FLOATING)
        if flown.run(SETTLE_S, "The arm floats", self._acting, None, lambda: self._wants_out):
            done.state = GripOutcome.RELEASED
            return done
        guide = self._taken_hold_of()
        for number in range(repetitions):
            flown.begin("go to the path")
            # The way starts at the arm's target, not at its position, so that the pull makes no step.
            way = Passage.planned(guide.target, path.q[0], APPROACH_RAD_S, 0.0, flown.period_s)
            guide = self._along(way, 1.0, guide.grip, counts=False)
            if guide.state is GripOutcome.ARRIVED:
                flown.begin(f"repeat {number + 1}")
                guide = self._along(path, speed, guide.grip, counts=True)
            if guide.state is not GripOutcome.ARRIVED:
                break
            done.repetitions += 1
        # An arm that did not arrive in time is released, too.
        done.state = GripOutcome.ENDED if guide.state is GripOutcome.LED else guide.state
        guide.let_go()
        flown.run(2.0 * DROP_S, "Releasing the arm", self._acting, guide)
        flown.begin(FLOATING)
        flown.float_again(guide, self._acting)
        return done

    def _taken_hold_of(self) -> PathGuide:
        """Grip the arm, and return a guide with a path of one posture."""
        flown, strength = self._flown, self._strength
        dt = flown.period_s
        flown.begin("take the arm along")
        anchor = Anchor(flown.q, strength, dt)

        def listen(moment: ObservedMotion) -> None:
            self._acting(moment)
            if self._wants_out:
                anchor.let_go()

        self._flown.lead(anchor, listen)
        self._flown.run(GRIP_S, "Gripping the arm", listen, anchor, lambda: self._wants_out)
        return PathGuide(motion.hold(anchor.target, 2.0 * dt, dt), strength, 1.0, anchor.grip)

    def _along(self, way: Trajectory | Passage, speed: float, grip: float, counts: bool) -> PathGuide:
        """Lead the arm along one path until its end or a release. Errors are collected if `counts` is set."""
        guide, done = PathGuide(way, self._strength, speed, grip), self._done
        guide.lead()
        if self._wants_out:
            guide.let_go()

        def listen(moment: ObservedMotion) -> None:
            self._acting(moment)
            if self._wants_out:
                guide.let_go()
            self._watch(guide)
            np.maximum(done.pull_max, np.abs(guide.tau), out=done.pull_max)
            done.v_max = max(done.v_max, float(np.abs(moment.v).max()))
            if counts and guide.state is GripOutcome.LED:
                done.errors.append(guide.target - moment.q)

        text = "Repeating the path" if counts else "Moving to the start of the path"
        self._flown.run(
            way.seconds / speed + PATIENCE_S, text, listen, guide, lambda: guide.has_let_go or guide.has_arrived
        )
        if guide.has_arrived:
            self._flown.run(REST_S, text, listen, guide, lambda: guide.has_let_go)
        done.waited_s += guide.waited_s
        return guide

    def _acting(self, _moment: ObservedMotion) -> None:
        self._wants_out = self._act() or self._wants_out
