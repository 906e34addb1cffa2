"""Stands between control and the machine: believes neither, bridges what is short, lets the arm down for what is not.

It needs no model and no control: a measurement and a submitted torque come in, or do not; what may go out goes out.
"""

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from exograv.signals import Joints, JointState

from .envelope import Envelope
from .ingress import COARSEST_COUNT_RAD, Ingress, IngressResult
from .monitors import Monitors
from .period import ticks_of
from .stops import StopReason

COMMAND_LIFE_S = 0.005
"""A command that is not replaced for so long is void [s] (docs/safety.md, SS0)."""

WINDOW_MS, IN_WINDOW_MAX_MS = 20, 3
"""Milliseconds, and for how many of them ticks may be missed, in a row too: bridged by the last valid torque; the next
tick is too many."""

SECOND_MS, IN_SECOND_MAX = 1000, 10
"""Milliseconds, and how many ticks in them may be missed one by one, whatever the period is."""

GRAVITY_LEVEL_S = 5.0
"""From weightless to Earth: 11 N·m, a heavy arm, come and go at 2.2 N·m/s (docs/safety.md)."""

STANDING_RAD_S = 0.05
"""Speed below which a joint stands still."""

SPEED_FILTER_S = 0.008
"""Of the guard's own velocity: a count of a coarse encoder is then a tenth of a radian per second [s]."""


class SafeState(enum.IntEnum):
    """What protects the person now; of several the greatest is in force (docs/safety.md, SS0 to SS3)."""

    NONE = -1
    """Control's own torque goes out, limited."""
    BRIDGE = 0
    """The last valid torque is held for some ticks."""
    DESCENT = 1
    """Soft descent."""
    DAMPING = 2
    """Damping only."""
    ISOLATION = 3
    """Soft descent, a distrusted joint braked by its own drive."""


@dataclass(frozen=True, slots=True)
class ControlRequest:
    """What control asks for."""

    sequence: int
    """The measurement that it answers."""

    valid_until: float
    """On the rig's clock [s]."""

    tau: Joints
    """[N·m]"""

    def answers(self, state: JointState, now: float) -> bool:
        """Whether it is about this measurement, and not void yet."""
        return self.sequence == state.sequence and now <= self.valid_until


class Guarded(NamedTuple):
    """What goes out."""

    tau: Joints
    """[N·m]"""

    drive_damping: Joints
    """What each drive adds by its own encoder [N·m·s/rad]."""

    safe_state: SafeState


class Guard:
    """Of one machine; latched by the first fault until `reset`."""

    def __init__(
        self,
        envelope: Envelope,
        ingress: Ingress,
        period_s: float,
        gain: Sequence[float] | None = None,
        compares: bool = True,
    ):
        """Nothing has happened yet.

        Args:
            envelope: Limits, and the person's where one is in the machine.
            ingress: Looks at what the machine says.
            period_s: Between two ticks [s].
            gain: Torque per motor current, as calibrated (joint,) [N·m/A]; None where torque has sensors of its own.
            compares: Whether signals that should say the same are compared; not on a machine that nobody has tried.
        """
        self._everywhere = range(len(envelope.limits.torque_max_Nm))
        self.envelope = envelope
        self._ingress, self._period_s = ingress, period_s
        self._monitors, self._compares = Monitors(len(self._everywhere), period_s, gain), compares
        self._seen = IngressResult(None)
        self._level_wanted: tuple[float, float] | None = None
        """The level that was asked for, and the step of a tick towards it."""
        self._q = self._v = [0.0] * len(self._everywhere)
        self._begin()

    @classmethod
    def of_machine(
        cls, envelope: Envelope, period_s: float, gain: Sequence[float] | None = None, is_known: bool = True
    ) -> "Guard":
        """Of a machine whose encoders' counts nobody has told.

        Args:
            envelope: As for the guard itself.
            period_s: Likewise.
            gain: Likewise.
            is_known: Whether it has been calibrated; one that is tried for the first time is neither doubted for what
                its encoders say nor for what its currents say.
        """
        counts = [COARSEST_COUNT_RAD if is_known else math.inf] * len(envelope.limits.torque_max_Nm)
        ingress = Ingress(counts, period_s, envelope.limits.v_trip_rad_s)
        return cls(envelope, ingress, period_s, gain, compares=is_known)

    def step(self, state: JointState | None, submitted: ControlRequest | None, now: float) -> Guarded:
        """One tick.

        Args:
            state: What the machine said in this tick, None if nothing.
            submitted: What control answered to it, None if nothing.
            now: On the rig's clock [s].
        """
        self.see(state, now)
        return self.decide(submitted, now)

    def see(self, state: JointState | None, now: float) -> JointState | None:
        """First half of a tick: what may be believed of a measurement, for control to answer to; None if nothing."""
        self._near_level()
        seen = self._seen = self._ingress.see(state, now, self.envelope.isolated)
        for reason, joint in seen.found:
            self.envelope.trip(reason, isolate=(joint,))
            # Without this joint the next measurement is a good one.
            self._measured = _Misses(self._period_s)
        if seen.state is not None:
            self._q = seen.state.q.tolist()
            self._v = self._speeds.update(self._q, seen.state.t)
            if self._compares:
                for reason, joint in self._monitors.look(seen.state, self.envelope.isolated):
                    # A torque that is not what was told may come from any cause: no torque by the model then, and
                    # none through that motor, which might turn the other way and drive where it is told to damp.
                    is_torque = reason is StopReason.TORQUE_WRONG
                    of_motor, of_encoder = ((joint,), ()) if is_torque else ((), (joint,))
                    self.envelope.trip(reason, without_model=is_torque, isolate=of_encoder, powerless=of_motor)
        return seen.state

    def decide(self, submitted: ControlRequest | None, now: float) -> Guarded:
        """Second half: what goes out, whether control has answered or not."""
        bridges = self._bridges(submitted, now)
        tau = self.envelope.limited(self._held, self._q, self._v)
        self._monitors.told(tau)
        asked = self._held if self.envelope.stop is None else tau  # what is asked in a descent is no matter
        if self._compares and self._monitors.is_refused(asked, tau, self._v):
            self.envelope.trip(StopReason.NOT_THIS_ARM)
        return Guarded(np.array(tau), self.envelope.drive_damping, self._safe_state(bridges))

    def lose_model(self) -> None:
        """Control's model does not fit the machine any more: a torque for another posture is arbitrary."""
        self.envelope.trip(StopReason.MODEL_LOST)

    def press_stop(self) -> None:
        """Somebody wants it to end: a soft descent, as for a fault."""
        self.envelope.trip(StopReason.STOP_PRESSED)

    def feel(self, gravity_level: float, ramp_s: float = 0.0) -> bool:
        """Let the person feel this share of the arm's weight, by a ramp from the next tick on; whether that may be now.

        Not above 1, nor while control moves the arm along a path, nor after a stop. The ramp takes `ramp_s`, or longer
        where that would be steeper than allowed.
        """
        person = self.envelope.person
        if person is None or person.is_driven or self.envelope.stop is not None:
            return False
        if not (0.0 <= gravity_level <= 1.0 and 0.0 <= ramp_s < math.inf):
            return False
        step = self._period_s / GRAVITY_LEVEL_S
        if ramp_s > 0.0:
            step = min(step, abs(gravity_level - person.gravity_level) * self._period_s / ramp_s)
        self._level_wanted = gravity_level, step
        return True

    def reset(self) -> bool:
        """Whether the latch was left: not while an arm comes down, nor while the machine does not say where it is."""
        believed = [j for j in self._everywhere if j not in self.envelope.isolated]
        # After a silence no joint is believed; then all have to stand still by what the machine says again.
        standing = all(abs(self._v[j]) < STANDING_RAD_S for j in believed or self._everywhere)
        if self._seen.state is None or not (self.envelope.descent_is_over and standing):
            return False
        self.envelope.reset()
        self._begin()
        return True

    def _begin(self) -> None:
        """Nothing is known of the last ticks."""
        self._speeds = _Speeds(len(self._everywhere), self._period_s)
        self._measured, self._answered = _Misses(self._period_s), _Misses(self._period_s)
        self._held = [0.0] * len(self._everywhere)

    def _near_level(self) -> None:
        """One tick of the way to the level that was asked for; a stop ends it where it is."""
        person = self.envelope.person
        if self._level_wanted is None or person is None or self.envelope.stop is not None:
            self._level_wanted = None
            return
        wanted, step = self._level_wanted
        left = wanted - person.gravity_level
        if abs(left) <= step:
            person.gravity_level, self._level_wanted = wanted, None
        else:
            person.gravity_level += math.copysign(step, left)

    def _bridges(self, submitted: ControlRequest | None, now: float) -> bool:
        """Take control's torque if it answers in time; whether the last one is held in its place."""
        state, broken = self._seen.state, self._seen.broken
        if self._measured.add(state is None):
            reason = StopReason.NO_MEASUREMENT if broken else StopReason.MACHINE_SILENT
            self.envelope.trip(reason, isolate=broken or self._everywhere)
        bridges = True
        if state is not None and submitted is not None and submitted.answers(state, now):
            self._held, bridges = submitted.tau.tolist(), False
        # What the machine does not say counts too: by turns, each within its bounds, the two would hold a torque on.
        if self._answered.add(bridges):
            self.envelope.trip(StopReason.CONTROL_SILENT)
        return bridges

    def _safe_state(self, bridges: bool) -> SafeState:
        if self.envelope.isolated:
            return SafeState.ISOLATION
        if self.envelope.without_model:
            return SafeState.DAMPING
        if self.envelope.stop is not None:
            return SafeState.DESCENT
        return SafeState.BRIDGE if bridges else SafeState.NONE


class _Misses:
    """Missed ticks of the last second, one bit each, and whether they are too many to bridge."""

    def __init__(self, period_s: float):
        self._ticks = 0
        self._recent, self._every = (2 ** ticks_of(ms, period_s) - 1 for ms in (WINDOW_MS, SECOND_MS))
        self._in_recent = ticks_of(IN_WINDOW_MAX_MS, period_s)

    def add(self, is_missed: bool) -> bool:
        """One tick; whether the bridge ends with it."""
        ticks = self._ticks = (self._ticks << 1 | is_missed) & self._every
        are_many = (ticks & self._recent).bit_count() > self._in_recent
        return is_missed and (are_many or ticks.bit_count() > IN_SECOND_MAX)


class _Speeds:
    """The guard's own velocities: filtered differences of positions, nothing of control's observer."""

    def __init__(self, joints: int, period_s: float):
        self._joints, self._period_s = range(joints), period_s
        self._q, self._v, self._t = list[float](), [0.0] * joints, 0.0

    def update(self, q: list[float], t: float) -> list[float]:
        """Take positions [rad] of the time `t` [s]; velocities [rad/s]."""
        passed = max(t - self._t, 0.5 * self._period_s)
        share = passed / (SPEED_FILTER_S + passed)
        before, v = self._q or q, self._v  # at first nothing moves
        for j in self._joints:
            v[j] += share * ((q[j] - before[j]) / passed - v[j])
        self._q, self._t = q, t
        return v
