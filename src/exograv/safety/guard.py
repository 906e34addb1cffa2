"""Guard between control and the machine: checks measurements and torques.

If they are missing for a short time, the guard holds the last valid torque. If they are missing for longer, it lets
the arm down softly. It needs no model and no control.
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
"""Time after which a command that was not replaced is void [s] (docs/explanation/safety.md, SS0)."""

WINDOW_MS, IN_WINDOW_MAX_MS = 20, 3
"""Window [ms], and the time of missed ticks in it that the last valid torque bridges [ms].

The limit also holds for missed ticks in a row. The next missed tick ends the bridge.
"""

SECOND_MS, IN_SECOND_MAX = 1000, 10
"""Window [ms], and the number of missed ticks in it that is bridged, whatever the period is."""

GRAVITY_LEVEL_S = 5.0
"""Time from weightless to Earth gravity [s].

The weight of a heavy arm, 11 N·m, then comes and goes at 2.2 N·m/s (docs/explanation/safety.md).
"""

STANDING_RAD_S = 0.05
"""Speed below which a joint counts as being at rest."""

SPEED_FILTER_S = 0.008
"""Time constant of the guard's own velocity [s].

One count of a coarse encoder then changes the velocity by a tenth of a radian per second.
"""


class SafeState(enum.IntEnum):
    """Reaction that protects the person.

    If several are required, the strongest one acts (docs/explanation/safety.md, SS0 to SS3).
    """

    NONE = -1
    """Limited torque of control."""
    BRIDGE = 0
    """Last valid torque, held for some ticks."""
    DESCENT = 1
    """Soft descent."""
    DAMPING = 2
    """Damping only."""
    ISOLATION = 3
    """Soft descent, in which a distrusted joint is braked by its own drive."""


@dataclass(frozen=True, slots=True)
class ControlRequest:
    """Torque that control submits for one measurement."""

    sequence: int
    """Number of the measurement that control answers."""

    valid_until: float
    """End of validity on the rig's clock [s]."""

    tau: Joints
    """Desired joint torque [N·m]."""

    def answers(self, state: JointState, now: float) -> bool:
        """Return True if the request answers this measurement and is not void yet."""
        return self.sequence == state.sequence and now <= self.valid_until


class Guarded(NamedTuple):
    """Command that goes out in one tick."""

    tau: Joints
    """Commanded joint torque [N·m]."""

    drive_damping: Joints
    """Damping that each drive adds by its own encoder [N·m·s/rad]."""

    safe_state: SafeState


class Guard:
    """Guard of one machine; the first fault latches it until `reset`."""

    def __init__(
        self,
        envelope: Envelope,
        ingress: Ingress,
        period_s: float,
        gain: Sequence[float] | None = None,
        compares: bool = True,
    ):
        """Start a guard that has seen no tick yet.

        Args:
            envelope: Limits of the machine, and of the person if one is in the machine.
            ingress: Check of the machine's measurements.
            period_s: Time between two ticks [s].
            gain: Calibrated torque per motor current (joint,) [N·m/A]; None if the machine has torque sensors.
            compares: True to compare redundant signals; False for a machine that is tried for the first time.
        """
        self._everywhere = range(len(envelope.limits.torque_max_Nm))
        self.envelope = envelope
        self._ingress, self._period_s = ingress, period_s
        self._monitors, self._compares = Monitors(len(self._everywhere), period_s, gain), compares
        self._seen = IngressResult(None)
        self._level_wanted: tuple[float, float] | None = None
        """Requested gravity level, and its change per tick."""
        self._q = self._v = [0.0] * len(self._everywhere)
        self._begin()

    @classmethod
    def of_machine(
        cls, envelope: Envelope, period_s: float, gain: Sequence[float] | None = None, is_known: bool = True
    ) -> "Guard":
        """Return a guard for a machine whose encoder counts are not known.

        Args:
            envelope: As for the guard itself.
            period_s: As for the guard itself.
            gain: As for the guard itself.
            is_known: True if the machine has been calibrated. On a machine that is tried for the first time neither
                encoders nor currents are doubted.
        """
        counts = [COARSEST_COUNT_RAD if is_known else math.inf] * len(envelope.limits.torque_max_Nm)
        ingress = Ingress(counts, period_s, envelope.limits.v_trip_rad_s)
        return cls(envelope, ingress, period_s, gain, compares=is_known)

    def step(self, state: JointState | None, submitted: ControlRequest | None, now: float) -> Guarded:
        """Run one tick and return what goes out.

        Args:
            state: Measurement of this tick; None if the machine sent nothing.
            submitted: Control's answer to the measurement; None if control sent nothing.
            now: Time on the rig's clock [s].
        """
        self.see(state, now)
        return self.decide(submitted, now)

    def see(self, state: JointState | None, now: float) -> JointState | None:
        """Run the first half of a tick: check the measurement.

        Returns:
            Measurement that control may use; None if there is none.
        """
        self._near_level()
        seen = self._seen = self._ingress.see(state, now, self.envelope.isolated)
        for reason, joint in seen.found:
            self.envelope.trip(reason, isolate=(joint,))
            # The next measurement is good again without this joint.
            self._measured = _Misses(self._period_s)
        if seen.state is not None:
            self._q = seen.state.q.tolist()
            self._v = self._speeds.update(self._q, seen.state.t)
            if self._compares:
                for reason, joint in self._monitors.look(seen.state, self.envelope.isolated):
                    # A torque that differs from the command may have any cause, so torques of the model are not used
                    # then. The motor of that joint gets no torque: it might turn the other way, and drive where damping
                    # is commanded.
                    is_torque = reason is StopReason.TORQUE_WRONG
                    of_motor, of_encoder = ((joint,), ()) if is_torque else ((), (joint,))
                    self.envelope.trip(reason, without_model=is_torque, isolate=of_encoder, powerless=of_motor)
        return seen.state

    def decide(self, submitted: ControlRequest | None, now: float) -> Guarded:
        """Run the second half of a tick: decide what goes out, with or without an answer of control."""
        bridges = self._bridges(submitted, now)
        tau = self.envelope.limited(self._held, self._q, self._v)
        self._monitors.told(tau)
        asked = self._held if self.envelope.stop is None else tau  # control's request does not count in a descent
        if self._compares and self._monitors.is_refused(asked, tau, self._v):
            self.envelope.trip(StopReason.NOT_THIS_ARM)
        return Guarded(np.array(tau), self.envelope.drive_damping, self._safe_state(bridges))

    def lose_model(self) -> None:
        """Start a soft descent because control's model no longer fits the machine.

        A torque for another posture is arbitrary.
        """
        self.envelope.trip(StopReason.MODEL_LOST)

    def press_stop(self) -> None:
        """Start a soft descent because a person pressed Stop."""
        self.envelope.trip(StopReason.STOP_PRESSED)

    def feel(self, gravity_level: float, ramp_s: float = 0.0) -> bool:
        """Lead the gravity level that the person feels to this value by a ramp, from the next tick on.

        The ramp takes `ramp_s`, or longer if it would be steeper than allowed.

        Returns:
            True if the request is accepted. It is refused above level 1, while control moves the arm along a path, and
            after a stop.
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
        """Leave the latched stop, and return True if that was possible.

        It is not possible while the arm comes down, while a joint moves, or while the machine sends no measurement.
        """
        believed = [j for j in self._everywhere if j not in self.envelope.isolated]
        # After a silence all joints are isolated. Then all must stand still by the measurements that arrive again.
        standing = all(abs(self._v[j]) < STANDING_RAD_S for j in believed or self._everywhere)
        if self._seen.state is None or not (self.envelope.descent_is_over and standing):
            return False
        self.envelope.reset()
        self._begin()
        return True

    def _begin(self) -> None:
        """Forget the ticks before."""
        self._speeds = _Speeds(len(self._everywhere), self._period_s)
        self._measured, self._answered = _Misses(self._period_s), _Misses(self._period_s)
        self._held = [0.0] * len(self._everywhere)

    def _near_level(self) -> None:
        """Move the gravity level one tick towards the requested one; a stop ends the ramp where it is."""
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
        """Use control's torque if it arrived in time. Return True if the last valid torque is held instead."""
        state, broken = self._seen.state, self._seen.broken
        if self._measured.add(state is None):
            reason = StopReason.NO_MEASUREMENT if broken else StopReason.MACHINE_SILENT
            self.envelope.trip(reason, isolate=broken or self._everywhere)
        bridges = True
        if state is not None and submitted is not None and submitted.answers(state, now):
            self._held, bridges = submitted.tau.tolist(), False
        # A missing measurement counts too. Otherwise control and machine could fail in turns, each within its bounds,
        # and a torque would be held on.
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
    """Missed ticks of the last second, one bit each; `add` finds when they are too many to bridge."""

    def __init__(self, period_s: float):
        self._ticks = 0
        self._recent, self._every = (2 ** ticks_of(ms, period_s) - 1 for ms in (WINDOW_MS, SECOND_MS))
        self._in_recent = ticks_of(IN_WINDOW_MAX_MS, period_s)

    def add(self, is_missed: bool) -> bool:
        """Add one tick; return True if the bridge ends with it."""
        ticks = self._ticks = (self._ticks << 1 | is_missed) & self._every
        are_many = (ticks & self._recent).bit_count() > self._in_recent
        return is_missed and (are_many or ticks.bit_count() > IN_SECOND_MAX)


class _Speeds:
    """Joint velocities of the guard: filtered differences of positions, independent of control's observer."""

    def __init__(self, joints: int, period_s: float):
        self._joints, self._period_s = range(joints), period_s
        self._q, self._v, self._t = list[float](), [0.0] * joints, 0.0

    def update(self, q: list[float], t: float) -> list[float]:
        """Take positions [rad] at the time `t` [s] and return velocities [rad/s]."""
        passed = max(t - self._t, 0.5 * self._period_s)
        share = passed / (SPEED_FILTER_S + passed)
        before, v = self._q or q, self._v  # the first tick has no speed
        for j in self._joints:
            v[j] += share * ((q[j] - before[j]) / passed - v[j])
        self._q, self._t = q, t
        return v
