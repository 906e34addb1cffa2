"""The last stage before the motors: whatever control asks for, what reaches a person is finite, bounded and slow.

Torque, torque rate, speed, finiteness; with a person in the machine, also what is plausible for this person in this
posture (`person.py`). Research software, informed by the medical standards, not compliant with them; a worn machine
needs an independent hardware emergency stop.
"""

import math
from collections.abc import Iterable

import numpy as np

from exograv.signals import Joints

from .limits import Limits
from .person import GuardedPerson, Numbers, within
from .stops import StopReason

V_CREDIBLE_RAD_S = 1e3
"""No joint is faster; beyond, a velocity is a broken signal."""

WITHOUT_MODEL = 2.0
"""Damping without a model over that of the soft descent: a falling hand then stays below 0.74 m/s (docs/safety.md)."""


class Envelope:
    """Keeps every command inside `Limits`; after a fault it is latched in a soft descent until `reset`."""

    def __init__(self, limits: Limits, dt: float):
        self.limits = limits
        self.stop: StopReason | None = None
        """Set once, by the first fault."""
        self.person: GuardedPerson | None = None
        """Who is in the machine; the drives' own limits alone while nobody is."""
        self.clipped_ticks = 0
        """How often torque or torque rate was limited."""
        self.isolated: frozenset[int] = frozenset()
        """Joints whose encoder is not believed any more; their own drives brake them."""
        self.powerless: frozenset[int] = frozenset()
        """Those of them whose motor is not believed either: told no torque, braked twice as hard by their drives."""
        self.without_model = False
        """Whether the descent only damps, because torques by the model are not believed any more."""
        self._dt, self._rate = dt, limits.torque_rate_max_Nm_per_s
        self._step, self._v_damping, self._v_trip = self._rate * dt, limits.v_damping_rad_s, limits.v_trip_rad_s
        self._bounds: Numbers = limits.torque_max_Nm.tolist()
        self._damping: Numbers = limits.damping_Nms_per_rad.tolist()
        self._none = [0.0] * len(self._bounds)
        self._no_damping = np.zeros(len(self._bounds))
        self._no_damping.flags.writeable = False  # every tick without a fault shares it
        self._q = self._tau = self._tau_at_stop = self._none
        self._since_stop = 0.0

    def begin(self, tau: Joints) -> None:
        """The machine gives this torque already (joint,) [N·m]: the next one follows it no faster than any other."""
        # A machine that does not say it, as NaN: from there every limit and the descent would let it through.
        rows = zip(tau.tolist(), self._bounds, strict=True)
        self._tau = [within(one, -bound, bound) if math.isfinite(one) else 0.0 for one, bound in rows]

    def limit(self, tau_desired: Joints, q: Joints, v: Joints) -> Joints:
        """Torque (joint,) [N·m] that may go out.

        Args:
            tau_desired: What control asks for (joint,) [N·m].
            q: Where the joints are (joint,) [rad].
            v: How fast they are (joint,) [rad/s].
        """
        return np.array(self.limited(tau_desired.tolist(), q.tolist(), v.tolist()))

    def limited(self, desired: Numbers, q: Numbers, v: Numbers) -> Numbers:
        """The same in plain numbers, which nobody may write into: they take a quarter of the time of arrays."""
        v, person = self._believed(q, v), self.person
        fastest = max(map(abs, v))
        # The friction of an incredible speed would lift every bound, and its power empty the tank for ever.
        known = v if fastest <= V_CREDIBLE_RAD_S else self._none
        if person is not None:
            person.look(self._q, known)
        self._watch(desired, v, fastest)
        wanted = desired if self.stop is None else self._descent()
        allowed = wanted if person is None else person.bounded(wanted)
        if self.stop is not None or fastest > self._v_damping or (person is not None and person.is_in_a_wall):
            # After the bounds: else what control pushes beyond them would be taken from the brake.
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
        """What each drive adds by its own encoder (joint,) [N·m·s/rad]: that of the descent for an isolated joint."""
        if not self.isolated:
            return self._no_damping
        share = [(j in self.isolated) * (WITHOUT_MODEL if j in self.powerless else 1.0) for j in range(len(self._tau))]
        return np.multiply(share, self._damping)

    @property
    def descent_is_over(self) -> bool:
        """Whether nothing of the torque at the stop is left."""
        return self._since_stop >= self.limits.descent_s

    def trip(
        self,
        reason: StopReason,
        *,
        without_model: bool = False,
        isolate: Iterable[int] = (),
        powerless: Iterable[int] = (),
    ) -> None:
        """Start the soft descent for a reason that somebody else found; the first reason stays, what is worse is added.

        Args:
            reason: What was found.
            without_model: Torques by the model are not believed: damp only, twice as hard.
            isolate: Joints whose encoder is not believed: their motion is not fed back, their drives brake them.
            powerless: Joints whose motor is not believed either: damping through it might drive.
        """
        if self.stop is None:
            self.stop, self._tau_at_stop = reason, self._tau
        self.without_model = self.without_model or without_model
        self.powerless |= frozenset(powerless)
        self.isolated |= self.powerless.union(isolate)

    def reset(self) -> None:
        """Leave the latched stop; an act of the operator. Torque goes on from where the descent has brought it."""
        self.stop, self._since_stop = None, 0.0
        self.without_model, self.isolated, self.powerless = False, frozenset(), frozenset()

    def _believed(self, q: Numbers, v: Numbers) -> Numbers:
        """Take the positions, if they mean anything; velocities, of which an isolated joint has none."""
        if self.isolated:
            q, v = q.copy(), v.copy()
            for joint in self.isolated:
                q[joint], v[joint] = self._q[joint], 0.0
        # Finite on both sides: minimum and maximum would hide a NaN.
        if all(map(math.isfinite, q)):
            self._q = q
        else:
            self.trip(StopReason.NO_MEASUREMENT)  # positions that mean nothing leave the last ones in force
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
            # Left to their drives: no command has held them, and any of it may be wrong.
            self.trip(StopReason.TOO_FAST, powerless=[j for j, speed in enumerate(v) if abs(speed) > v_trip])

    def _descent(self) -> Numbers:
        self._since_stop += self._dt
        if self.without_model:
            return self._none
        share = max(0.0, 1.0 - self._since_stop / self.limits.descent_s)
        return [0.0 if j in self.powerless else tau * share for j, tau in enumerate(self._tau_at_stop)]

    def _brake(self, joint: int, v: float) -> float:
        """Damping torque: on all motion while descending; else on what is too fast, and before a joint's stop."""
        if self.stop is not None:
            return (WITHOUT_MODEL if self.without_model else 1.0) * self._damping[joint] * v
        excess = max(abs(v) - self._v_damping, 0.0)
        in_wall = 0.0 if self.person is None else self.person.wall(joint, v) * abs(v)
        return math.copysign(self._damping[joint] * max(excess, in_wall), v)
