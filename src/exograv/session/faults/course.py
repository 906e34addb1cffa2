"""What happened in one scenario: notes while it flies, figures when it is over."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.rig.twin import Truth
from exograv.safety.envelope import StopReason
from exograv.safety.guard import SafeState

from .oracle import Judgement

Joints = Float[np.ndarray, " joint"]

MOVING_RAD_S = 0.2
"""Speed at which a fault that shows in motion has to show [rad/s]."""


@dataclass
class Course:
    """Of one scenario."""

    ticks: int = 0
    violations: list[str] = field(default_factory=list)
    """What went out that should not have; the first ones, in words."""

    violated_ticks: int = 0
    stopped_tick: int | None = None
    reason: StopReason | None = None
    since: dict[SafeState, int] = field(default_factory=dict)
    """Tick with which that state, or a worse one, came first."""

    braked_tick: int | None = None
    """From the first onset on: at the beginning of which all drives were braking by themselves."""

    moving_since: dict[int, int] = field(default_factory=dict)
    """Tick from the first onset on in which each joint was first clearly moving."""

    extra_speed: float = 0.0
    """By which a joint grew faster between the first onset and the safe state [rad/s]."""

    extra_way_deg: float = 0.0
    hand_m_s: float = 0.0
    """The hand's greatest speed from the safe state on, while nobody pushes it."""

    pushed_hand_m_s: float = 0.0
    """The same while somebody does, and until the hand has had time to slow down."""

    torque_step_Nm: float = 0.0
    """Greatest change of a command from one tick to the next after the first onset [N·m]."""

    crashed: str | None = None
    """The twin or the software gave up."""

    @property
    def worst(self) -> SafeState:
        """Greatest safe state that came."""
        return max(self.since, default=SafeState.NONE)


class Watch:
    """Takes notes of one flight, by the twin's truth: the examiner's business, nobody flies by it."""

    def __init__(self, onset: int | None):
        """Nothing has happened; `onset` is the tick of the first fault."""
        self.course = Course()
        self._onset = onset
        self._told: list[Joints] = []
        self._seen: list[tuple[Joints, Joints]] = []

    @property
    def told(self) -> Float[np.ndarray, "tick joint"]:
        """What each joint was told in every tick [N·m]."""
        return np.array(self._told)

    def commanded(self, tick: int, tau: Joints, safe_state: SafeState, stop: StopReason | None) -> None:
        """What the guard decided in a tick."""
        course = self.course
        self._told.append(tau)
        if stop is not None and course.stopped_tick is None:
            course.stopped_tick, course.reason = tick, stop
        if safe_state > course.worst:
            course.since |= {state: tick for state in SafeState if course.worst < state <= safe_state}

    def moved(self, tick: int, seen: Truth) -> None:
        """Where the machine truly was in a tick after the first onset."""
        if self._onset is not None and tick >= self._onset:
            self._seen.append((seen.q, seen.v))

    def hand(self, speed: float, is_pushed: bool) -> None:
        """The hand's speed after the safe state [m/s]."""
        course = self.course
        if is_pushed:
            course.pushed_hand_m_s = max(course.pushed_hand_m_s, speed)
        else:
            course.hand_m_s = max(course.hand_m_s, speed)

    def finish(self, judgement: Judgement) -> Course:
        """Sum up."""
        course = self.course
        course.violated_ticks = len(judgement.wrong)
        course.violations = [f"tick {tick}: {what}" for tick, what in list(judgement.wrong.items())[:3]]
        if self._onset is not None and self._seen:
            course.torque_step_Nm = float(judgement.step_Nm[self._onset :].max(initial=0.0))
            self._sum_up_motion(self._onset, *map(np.array, zip(*self._seen, strict=True)))
        return course

    def _sum_up_motion(self, onset: int, q: np.ndarray, v: np.ndarray) -> None:
        course, moving = self.course, np.abs(v) > MOVING_RAD_S
        course.moving_since = {int(j): onset + int(np.argmax(moving[:, j])) for j in np.flatnonzero(moving.any(axis=0))}
        until = len(q) if course.stopped_tick is None else max(course.stopped_tick - onset, 0)
        if until:
            course.extra_speed = float(np.abs(v[:until] - v[0]).max())
            course.extra_way_deg = float(np.rad2deg(np.abs(q[:until] - q[0]).max()))
