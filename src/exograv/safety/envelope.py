"""Last stage before the motors: commanded torque to a person is finite, bounded and slow, whatever control asks for.

The envelope limits torque, torque rate and speed, and stops on non-finite values. With a person in the machine, it also
limits torque to what is plausible for this person in this posture (`person.py`). This is research software, informed by
the medical standards and not compliant with them. A worn machine needs an independent hardware emergency stop.
"""

import math
from collections.abc import Iterable

import numpy as np

from exograv.signals import Joints

from .limits import Limits
from .person import GuardedPerson, Numbers, within
from .stops import StopReason

V_CREDIBLE_RAD_S = 1e3
"""Speed that no joint reaches; a velocity above it is a broken signal."""

WITHOUT_MODEL = 2.0
"""Damping without a model, as a multiple of the soft descent's damping.

A falling hand then stays below 0.74 m/s (docs/explanation/safety.md).
"""


class Envelope:
    """Limiter that keeps each command inside `Limits`; a fault latches it in a soft descent until `reset`."""

    def __init__(self, limits: Limits, dt: float):
        self.limits = limits
        self.stop: StopReason | None = None
        """Reason of the first fault; later faults do not change it."""
        self.person: GuardedPerson | None = None
        """Person in the machine; None if nobody is, and then only the drives' own limits apply."""
        self.clipped_ticks = 0
        """Ticks in which torque or torque rate was limited."""
        self.isolated: frozenset[int] = frozenset()
        """Joints whose encoder is not trusted any more; their own drives brake them."""
        self.powerless: frozenset[int] = frozenset()
        """Isolated joints whose motor is not trusted either: it gets no torque, and the drive brakes twice as hard."""
        self.without_model = False
        """True if the descent only damps, because torques of the model are not trusted any more."""
        self._dt, self._rate = dt, limits.torque_rate_max_Nm_per_s
        self._step, self._v_damping, self._v_trip = self._rate * dt, limits.v_damping_rad_s, limits.v_trip_rad_s
        self._bounds: Numbers = limits.torque_max_Nm.tolist()
        self._damping: Numbers = limits.damping_Nms_per_rad.tolist()
        self._none = [0.0] * len(self._bounds)
        self._no_damping = np.zeros(len(self._bounds))
        self._no_damping.flags.writeable = False  # shared by all ticks without a fault
        self._q = self._tau = self._tau_at_stop = self._none
        self._since_stop = 0.0

    def begin(self, tau: Joints) -> None:
        """Start the rate limit from the torque that the machine already gives (joint,) [N·m]."""
        # A machine that does not report its torque gives NaN. Every limit and the descent would let NaN through.
        rows = zip(tau.tolist(), self._bounds, strict=True)
        self._tau = [within(one, -bound, bound) if math.isfinite(one) else 0.0 for one, bound in rows]

    def limit(self, tau_desired: Joints, q: Joints, v: Joints) -> Joints:
        """Return the torque (joint,) [N·m] that may go out.

        Args:
            tau_desired: Torque that control asks for (joint,) [N·m].
            q: Joint positions (joint,) [rad].
            v: Joint velocities (joint,) [rad/s].
        """
        return np.array(self.limited(tau_desired.tolist(), q.tolist(), v.tolist()))

    def limited(self, desired: Numbers, q: Numbers, v: Numbers) -> Numbers:
        """Return the torque that may go out, as `limit`, from plain numbers and as plain numbers.

        Plain numbers take a quarter of the time of arrays. Callers must not write into the returned list.
        """
        v, person = self._believed(q, v), self.person
        fastest = max(map(abs, v))
        # Friction at an incredible speed would lift every bound, and its power would empty the tank for good.
        known = v if fastest <= V_CREDIBLE_RAD_S else self._none
        if person is not None:
            person.look(self._q, known)
        self._watch(desired, v, fastest)
        wanted = desired if self.stop is None else self._descent()
        allowed = wanted if person is None else person.bounded(wanted)
        if self.stop is not None or fastest > self._v_damping or (person is not None and person.is_in_a_wall):
            # Braking follows the bounds. Before them, a demand of control beyond the bounds would cancel the brake.
            brakes = [self._brake(joint, speed) for joint, speed in enumerate(v)]
            wanted = [tau - brake for tau, brake in zip(wanted, brakes, strict=True)]
            allowed = wanted if person is None else person.braked(allowed, brakes)
        if person is not None:
            allowed = person.afford(allowed, known, self._rate)
        tau, step, bounds = list(allowed), self._step, self._bounds
        for j, last in enumerate(self._tau):
            tau[j] = within(within(tau[j], -bounds[j], bounds[j]), last - step, last + step)
        if person is not None:
            person.pay(tau, known, self._dt)
        if self.stop is None and tau != wanted:
            self.clipped_ticks += 1
        self._tau = tau
        return tau

    @property
    def drive_damping(self) -> Joints:
        """Damping that each drive adds by its own encoder (joint,) [N·m·s/rad]; non-zero only for isolated joints."""
        if not self.isolated:
            return self._no_damping
        share = [(j in self.isolated) * (WITHOUT_MODEL if j in self.powerless else 1.0) for j in range(len(self._tau))]
        return np.multiply(share, self._damping)

    @property
    def descent_is_over(self) -> bool:
        """True if the torque at the stop has faded to zero."""
        return self._since_stop >= self.limits.descent_s

    def trip(
        self,
        reason: StopReason,
        *,
        without_model: bool = False,
        isolate: Iterable[int] = (),
        powerless: Iterable[int] = (),
    ) -> None:
        """Start the soft descent for a reason that another part found.

        The first reason stays. A later call can only add distrusted joints or remove the model.

        Args:
            reason: Fault that was found.
            without_model: True if torques of the model are not trusted: the descent only damps, twice as hard.
            isolate: Joints whose encoder is not trusted: their motion is not fed back, and their drives brake them.
            powerless: Joints whose motor is not trusted either: damping through such a motor might drive the joint.
        """
        if self.stop is None:
            self.stop, self._tau_at_stop = reason, self._tau
        self.without_model = self.without_model or without_model
        self.powerless |= frozenset(powerless)
        self.isolated |= self.powerless.union(isolate)

    def reset(self) -> None:
        """Leave the latched stop, as an act of the operator.

        Torque goes on from the value that the descent has reached.
        """
        self.stop, self._since_stop = None, 0.0
        self.without_model, self.isolated, self.powerless = False, frozenset(), frozenset()

    def _believed(self, q: Numbers, v: Numbers) -> Numbers:
        """Keep the positions if they are finite, and return the velocities, or zeros if one is not finite.

        The velocity of an isolated joint is zero.
        """
        if self.isolated:
            q, v = q.copy(), v.copy()
            for joint in self.isolated:
                q[joint], v[joint] = self._q[joint], 0.0
        # Minimum and maximum would hide a NaN, so every value is tested.
        if all(map(math.isfinite, q)):
            self._q = q
        else:
            self.trip(StopReason.NO_MEASUREMENT)  # non-finite positions leave the last ones in force
        if all(map(math.isfinite, v)):
            return v
        self.trip(StopReason.NO_MEASUREMENT)
        return self._none

    def _watch(self, desired: Numbers, v: Numbers, fastest: float) -> None:
        person, v_trip = self.person, self._v_trip
        if not all(map(math.isfinite, desired)):
            self.trip(StopReason.NOT_FINITE)
        elif person is not None and person.is_in_a_wall and person.is_past_a_stop:
            self.trip(StopReason.PAST_A_STOP)
        if person is not None:
            v_trip = min(v_trip, person.limits.v_trip_rad_s)
        if fastest > v_trip:
            # Such a joint is left to its drive: no command has held it, and its motor or its encoder may be wrong.
            self.trip(StopReason.TOO_FAST, powerless=[j for j, speed in enumerate(v) if abs(speed) > v_trip])

    def _descent(self) -> Numbers:
        self._since_stop += self._dt
        if self.without_model:
            return self._none
        share = max(0.0, 1.0 - self._since_stop / self.limits.descent_s)
        return [0.0 if j in self.powerless else tau * share for j, tau in enumerate(self._tau_at_stop)]

    def _brake(self, joint: int, v: float) -> float:
        """Damping torque of one joint [N·m].

        In a descent it damps all motion. Otherwise it damps speed beyond the limit, and motion into the wall before a
        stop.
        """
        if self.stop is not None:
            return (WITHOUT_MODEL if self.without_model else 1.0) * self._damping[joint] * v
        excess = max(abs(v) - self._v_damping, 0.0)
        in_wall = 0.0 if self.person is None else self.person.wall(joint, v) * abs(v)
        return math.copysign(self._damping[joint] * max(excess, in_wall), v)
