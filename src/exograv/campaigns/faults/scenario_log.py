"""Log of one scenario: notes during the flight, figures after it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

from .fault_plant import TruthSample
from .oracle import Judgement

Joints = Float[np.ndarray, " joint"]

MOVING_RAD_S = 0.2
"""Joint speed from which on a fault of a moving joint has to show [rad/s]."""

RELEASE_MS = 100
"""Time after a push in which the braked hand loses the speed of the push [ms]."""


@dataclass
class ScenarioLog:
    """Log of one scenario."""

    ticks: int = 0
    period_ms: int = 1
    """Time between two ticks [ms]."""
    violations: list[str] = field(default_factory=list)
    """First violations of the envelope, one sentence each."""

    violated_ticks: int = 0
    stopped_tick: int | None = None
    reason: StopReason | None = None
    since: dict[SafeState, int] = field(default_factory=dict)
    """First tick in which this safe state, or a more restrictive one, was in force."""

    braked_tick: int | None = None
    """First tick after the first onset in which all drives brake by themselves; None if there was none."""

    extra_speed: float = 0.0
    """Largest change of a joint's speed between the first onset and the safe state [rad/s]."""

    extra_way_deg: float = 0.0
    hand_m_s: float = 0.0
    """Fastest hand after the safe state began, while the wearer does not push [m/s]."""

    pushed_hand_m_s: float = 0.0
    """Fastest hand after the safe state began, during a push and until the hand has had time to slow down [m/s]."""

    torque_step_Nm: float = 0.0
    """Largest change of a command from one tick to the next after the first onset [N·m]."""

    crashed: str | None = None
    """Exception of the twin or the software, as text; None if the run raised no exception."""

    @property
    def worst(self) -> SafeState:
        """Most restrictive safe state that the guard entered during the run."""
        return max(self.since, default=SafeState.NONE)


class TruthWatch:
    """Collector of one flight's data and of the twin's truth. Only the examiner uses it, never a controller."""

    def __init__(self, onset: int | None, period_ms: int = 1):
        """Begin before the first tick; `onset` is the tick of the first fault."""
        self.course = ScenarioLog(period_ms=period_ms)
        self._onset = onset
        self._told: list[Joints] = []
        self._pushed: list[bool] = []
        self.moves: Bool[np.ndarray, "tick joint"] = np.zeros((0, 0), bool)
        """Joints that clearly move in each tick from the first onset on; known after the flight."""

    @property
    def told(self) -> Float[np.ndarray, "tick joint"]:
        """Commanded torque of each joint in every tick [N·m]."""
        return np.array(self._told)

    def pushed(self, is_so: bool) -> None:
        """Note whether the wearer pushes in the next tick."""
        self._pushed.append(is_so)

    def commanded(self, tick: int, tau: Joints, safe_state: SafeState, stop: StopReason | None) -> None:
        """Note the guard's decision in a tick."""
        course = self.course
        self._told.append(tau)
        if stop is not None and course.stopped_tick is None:
            course.stopped_tick, course.reason = tick, stop
        if safe_state > course.worst:
            course.since |= {state: tick for state in SafeState if course.worst < state <= safe_state}

    def finish(self, judgement: Judgement, sights: Sequence[TruthSample]) -> ScenarioLog:
        """Compute the figures. `sights` has one sample per tick, and may have one more for the end."""
        course, onset = self.course, self._onset
        course.violated_ticks = len(judgement.wrong)
        course.violations = [f"tick {tick}: {what}" for tick, what in list(judgement.wrong.items())[:3]]
        self.moves = np.zeros(self.told.shape, bool)
        if onset is None:
            return course
        braking = (tick for tick, sight in enumerate(sights) if tick > onset and sight.are_braking)
        course.braked_tick = next(braking, None)
        if seen := sights[onset : course.ticks]:
            course.torque_step_Nm = float(judgement.step_Nm[onset:].max(initial=0.0))
            self._sum_up_motion(onset, np.array([one.q for one in seen]), np.array([one.v for one in seen]))
        self._sum_up_hand(sights[: course.ticks])
        return course

    def _sum_up_motion(self, onset: int, q: np.ndarray, v: np.ndarray) -> None:
        course, self.moves[onset : onset + len(v)] = self.course, np.abs(v) > MOVING_RAD_S
        until = len(q) if course.stopped_tick is None else max(course.stopped_tick - onset, 0)
        if until:
            course.extra_speed = float(np.abs(v[:until] - v[0]).max())
            course.extra_way_deg = float(np.rad2deg(np.abs(q[:until] - q[0]).max()))

    def _sum_up_hand(self, sights: Sequence[TruthSample]) -> None:
        """Compute the largest hand speeds after the first stop or braking [m/s], with and without a push.

        A tick within `RELEASE_MS` after a push counts as pushed, because the hand needs time to slow down.
        """
        course, release = self.course, RELEASE_MS // self.course.period_ms
        protected = [tick for tick in (course.stopped_tick, course.braked_tick) if tick is not None]
        pushed_tick = -release - 1
        for tick, sight in enumerate(sights):
            pushed_tick = tick if self._pushed[tick] else pushed_tick
            if tick < min(protected, default=len(sights)):
                continue
            if tick - pushed_tick <= release:
                course.pushed_hand_m_s = max(course.pushed_hand_m_s, sight.hand_m_s)
            else:
                course.hand_m_s = max(course.hand_m_s, sight.hand_m_s)
