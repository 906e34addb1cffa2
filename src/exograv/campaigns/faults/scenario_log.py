"""Log of one scenario: notes during the flight, figures after it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from exograv.safety.guard import SafeState
from exograv.safety.plausible import PlausibleTable
from exograv.safety.stops import StopReason

from .acceptance import RELEASED_HAND_M_S
from .fault_plant import TruthSample
from .oracle import Judgement, power_beyond

Joints = Float[np.ndarray, " joint"]

MOVING_RAD_S = 0.2
"""Speed above which a joint counts as moving [rad/s]. Some faults are detectable only on a moving joint."""

DRIFT_MS = 500
"""Time over which the drift of a joint is averaged [ms]."""

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
    told_tick: int | None = None
    """First tick in which the drift monitor told the operator; None if it did not before the arm came down."""

    since: dict[SafeState, int] = field(default_factory=dict)
    """First tick in which this safe state, or a more restrictive one, was in force."""

    braked_tick: int | None = None
    """First tick after the first onset in which all drives brake by themselves; None if there was none."""

    extra_speed: float = 0.0
    """Largest difference of a joint's speed between the first onset and the safe state [rad/s].

    The difference is from the onset. Where the same flight without faults was flown, it is the smaller one of this and
    the difference from that flight."""

    extra_way_deg: float = 0.0
    """Largest difference of a joint's position, as above [°]."""

    drift_deg_s: float = 0.0
    """Largest mean speed of that difference over `DRIFT_MS` [°/s]; 0 where no flight without faults was flown."""

    hand_m_s: float = 0.0
    """Fastest hand after the safe state began, while the wearer does not push [m/s]."""

    pushed_hand_m_s: float = 0.0
    """Fastest hand after the safe state began, during a push and until the hand has had time to slow down [m/s]."""

    flight_hand_m_s: float = 0.0
    """Fastest hand from the first onset to the end of the flight, outside of a push as above [m/s]."""

    power_W: float = 0.0
    """Largest power into the person beyond compensation, from the first onset on [W]."""

    injected_J: float = 0.0
    """Largest energy into the person beyond compensation, from the first onset to the safe state [J]."""

    gravity_torque_change_Nm_s: float = 0.0
    """Largest change per second of the torque that carries the arm in one posture, by its parameters alone [N·m/s]."""

    arm_bound: float = 0.0
    """First moments of the arm in force, relative to the nearer plausible bound [-]; 0 where the fault leaves them."""

    torque_step_Nm: float = 0.0
    """Largest change of a command from one tick to the next after the first onset [N·m]."""

    unbalanced: float = 0.0
    """Largest share of the arm's weight that the fault leaves without support, or adds to it [-]."""

    way_rad: float = 0.0
    """Way of the fastest joint from the first onset to the fastest hand, there and back [rad]."""

    healthy_hand_m_s: float = 0.0
    """Fastest hand of the same flight without the fault [m/s]; 0 where that flight was not needed."""

    crashed: str | None = None
    """Exception of the twin or the software, as text; None if the run raised no exception."""

    diverged: bool = False
    """True if the exception is a diverged twin."""

    @property
    def worst(self) -> SafeState:
        """Most restrictive safe state that the guard entered during the run."""
        return max(self.since, default=SafeState.NONE)

    @property
    def falling_hand_m_s(self) -> float:
        """Hand speed of an arm that its unbalanced weight drives along the way of this flight [m/s].

        The largest torque of the weight works along the way, and gives no more energy than a fall from the horizontal.
        The energy of the same flight without the fault is added.
        """
        return math.hypot(
            self.healthy_hand_m_s, RELEASED_HAND_M_S * math.sqrt(self.unbalanced * min(self.way_rad, 1.0))
        )


class TruthWatch:
    """Collector of one flight's data and of the twin's truth. Only the examiner uses it, never a controller."""

    def __init__(self, onset: int | None, period_ms: int = 1, table: PlausibleTable | None = None):
        """Begin before the first tick.

        Args:
            onset: Tick of the first fault.
            period_ms: Time between two ticks [ms].
            table: Torque that carries the person's arm; without it, power and energy stay 0.
        """
        self.course = ScenarioLog(period_ms=period_ms)
        self._onset, self._table = onset, table
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

    def warned(self, tick: int) -> None:
        """Note that the drift monitor told the operator."""
        if self.course.told_tick is None:
            self.course.told_tick = tick

    def forget(self) -> None:
        """Forget the torques of past ticks."""
        self._told.clear()
        self._pushed.clear()

    def finish(
        self, judgement: Judgement, sights: Sequence[TruthSample], healthy: Sequence[TruthSample] = ()
    ) -> ScenarioLog:
        """Compute the figures.

        Args:
            judgement: Judgement of the envelope's oracle.
            sights: Truth of each tick, and possibly one more sample for the end.
            healthy: Truth of the same flight without faults; empty if it was not flown.
        """
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
            q, v = np.array([one.q for one in seen]), np.array([one.v for one in seen])
            self._sum_up_motion(onset, q, v, healthy[onset : course.ticks])
            self._sum_up_power(onset, q, v)
            until = int(np.argmax([one.hand_m_s for one in seen])) + 1
            course.way_rad = float(1e-3 * course.period_ms * np.abs(v[:until]).max(axis=1).sum())
        self._sum_up_hand(onset, sights[: course.ticks])
        return course

    def _before_safe(self, onset: int, count: int) -> int:
        """Return the number of ticks from the onset to the first stop, at most `count`."""
        stopped = self.course.stopped_tick
        return count if stopped is None else max(stopped - onset, 0)

    def _sum_up_motion(self, onset: int, q: np.ndarray, v: np.ndarray, healthy: Sequence[TruthSample]) -> None:
        course, self.moves[onset : onset + len(v)] = self.course, np.abs(v) > MOVING_RAD_S
        off_q, off_v = np.abs(q - q[0]), np.abs(v - v[0])
        if healthy:
            count, window = min(len(q), len(healthy)), DRIFT_MS // course.period_ms
            other_q, other_v = (np.array([getattr(one, name) for one in healthy[:count]]) for name in ("q", "v"))
            # The fault moves neither an arm that moves as without it, nor an arm that it only holds.
            off_q = np.minimum(off_q[:count], np.abs(q[:count] - other_q))
            off_v = np.minimum(off_v[:count], np.abs(v[:count] - other_v))
            own, other = q[window:count] - q[: count - window], other_q[window:] - other_q[: count - window]
            ways = np.minimum(np.abs(own), np.abs(own - other)) if count > window else np.zeros(0)
            course.drift_deg_s = float(np.rad2deg(ways.max(initial=0.0)) / (1e-3 * DRIFT_MS))
        until = self._before_safe(onset, len(off_q))
        course.extra_speed = float(off_v[:until].max(initial=0.0))
        course.extra_way_deg = float(np.rad2deg(off_q[:until].max(initial=0.0)))

    def _sum_up_power(self, onset: int, q: np.ndarray, v: np.ndarray) -> None:
        if self._table is None:
            return
        course, tau = self.course, self.told[onset : onset + len(q)]
        power = power_beyond(self._table, tau, q[: len(tau)], v[: len(tau)], np.zeros(len(tau)))
        energy = 1e-3 * course.period_ms * power[: self._before_safe(onset, len(power))].cumsum()
        course.power_W, course.injected_J = float(power.max(initial=0.0)), float(energy.max(initial=0.0))

    def _sum_up_hand(self, onset: int, sights: Sequence[TruthSample]) -> None:
        """Compute the largest hand speeds [m/s]: after the first stop or braking, and in the whole flight.

        A tick within `RELEASE_MS` after a push counts as pushed, because the hand needs time to slow down.
        """
        course, release = self.course, RELEASE_MS // self.course.period_ms
        protected = [tick for tick in (course.stopped_tick, course.braked_tick) if tick is not None]
        pushed_tick = -release - 1
        for tick, sight in enumerate(sights):
            pushed_tick = tick if self._pushed[tick] else pushed_tick
            is_pushed, is_safe = tick - pushed_tick <= release, tick >= min(protected, default=len(sights))
            if is_pushed and is_safe:
                course.pushed_hand_m_s = max(course.pushed_hand_m_s, sight.hand_m_s)
            if not is_pushed and is_safe:
                course.hand_m_s = max(course.hand_m_s, sight.hand_m_s)
            if not is_pushed and tick >= onset:
                course.flight_hand_m_s = max(course.flight_hand_m_s, sight.hand_m_s)
