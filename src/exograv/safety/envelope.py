"""Last stage before the motors: commanded torque to a person is finite, bounded and slow, whatever control asks for.

The envelope limits torque, torque rate and speed, and stops on non-finite values. With a person in the machine, it also
limits torque to what is plausible for this person in this posture (`person.py`). This is research software, informed by
the medical standards and not compliant with them. A worn machine needs an independent hardware emergency stop.
"""

from collections.abc import Iterable

import numpy as np

from exograv.signals import Joints

from .limits import Limits
from .native import core
from .native.library import LIBRARY, Library
from .person import GuardedPerson
from .record import GuardRecord
from .stops import StopReason

REASONS = dict(enumerate(StopReason, start=1))
"""Reasons by their number in the record."""
NUMBERS = {reason: number for number, reason in REASONS.items()}


class Envelope:
    """Limiter that keeps each command inside `Limits`; a fault latches it in a soft descent until `reset`."""

    def __init__(self, limits: Limits, dt: float, library: Library | None = LIBRARY):
        """Start an envelope that gives no torque yet.

        Args:
            limits: Limits of the machine.
            dt: Time between two ticks [s].
            library: Compiled guard; None runs the Python source.
        """
        self.limits, self._person = limits, None
        self.record = record = GuardRecord(len(limits.torque_max_Nm), dt, library)
        r = record.numbers
        r[core.RATE], r[core.V_DAMPING] = limits.torque_rate_max_Nm_per_s, limits.v_damping_rad_s
        r[core.V_TRIP], r[core.DESCENT_S] = limits.v_trip_rad_s, limits.descent_s
        record.put(core.TORQUE_MAX, limits.torque_max_Nm)
        record.put(core.DAMPING, limits.damping_Nms_per_rad)
        self._no_damping = np.zeros(record.joints)
        self._no_damping.flags.writeable = False  # shared by all ticks without a fault

    @property
    def person(self) -> GuardedPerson | None:
        """Person in the machine; None if nobody is, and then only the drives' own limits apply."""
        return self._person

    @person.setter
    def person(self, person: GuardedPerson | None) -> None:
        if self._person is not None:
            self._person.leave()
        if person is not None:
            person.enter(self.record)
        self._person = person

    @property
    def stop(self) -> StopReason | None:
        """Reason of the first fault; later faults do not change it."""
        number = self.record.numbers[core.STOP]
        return None if number == 0.0 else REASONS[int(number)]

    @property
    def clipped_ticks(self) -> int:
        """Ticks in which torque or torque rate was limited."""
        return int(self.record.numbers[core.CLIPPED])

    @property
    def isolated(self) -> frozenset[int]:
        """Joints whose encoder is not trusted any more; their own drives brake them."""
        return self.record.joints_at(core.ISOLATED)

    @property
    def powerless(self) -> frozenset[int]:
        """Isolated joints whose motor is not trusted either: it gets no torque, and the drive brakes twice as hard."""
        return self.record.joints_at(core.POWERLESS)

    @property
    def without_model(self) -> bool:
        """True if the descent only damps, because torques of the model are not trusted any more."""
        return self.record.numbers[core.WITHOUT_MODEL] != 0.0

    def begin(self, tau: Joints) -> None:
        """Start the rate limit from the torque that the machine already gives (joint,) [N·m]."""
        self.record.put(core.DESIRED, tau)
        core.begin_torque(self.record.numbers)

    def limit(self, tau_desired: Joints, q: Joints, v: Joints) -> Joints:
        """Return the torque (joint,) [N·m] that may go out.

        Args:
            tau_desired: Torque that control asks for (joint,) [N·m].
            q: Joint positions (joint,) [rad].
            v: Joint velocities (joint,) [rad/s].
        """
        record = self.record
        record.put(core.DESIRED, tau_desired)
        record.put(core.Q_GIVEN, q)
        record.put(core.V_GIVEN, v)
        record.tick.limit()
        return record.of(core.TAU).copy()

    @property
    def drive_damping(self) -> Joints:
        """Damping that each drive adds by its own encoder (joint,) [N·m·s/rad]; non-zero only for isolated joints."""
        if self.record.numbers[core.STOP] == 0.0:  # no joint is isolated without a stop
            return self._no_damping
        share = self.record.of(core.ISOLATED) + (core.WITHOUT_MODEL_SHARE - 1.0) * self.record.of(core.POWERLESS)
        return share * self.record.of(core.DAMPING)

    @property
    def descent_is_over(self) -> bool:
        """True if the torque at the stop has faded to zero."""
        return self.record.numbers[core.SINCE_STOP] >= self.limits.descent_s

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
        r = self.record.numbers
        core.trip(r, NUMBERS[reason], without_model)
        for joint in isolate:
            core.isolate(r, joint, False)
        for joint in powerless:
            core.isolate(r, joint, True)

    def reset(self) -> None:
        """Leave the latched stop, as an act of the operator.

        Torque goes on from the value that the descent has reached.
        """
        core.leave_stop(self.record.numbers)
