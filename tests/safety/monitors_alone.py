"""Monitors of the guard, run without ingress and envelope."""

from collections.abc import Collection, Sequence

import numpy as np

from exograv.safety.ingress import put_measurement
from exograv.safety.monitors import set_monitors
from exograv.safety.native import core
from exograv.safety.record import GuardRecord
from exograv.safety.stops import Finding, StopReason
from exograv.signals import JointState

FLAGS = {
    core.FAULTY: StopReason.DRIVE_FAULT,
    core.PARTED: StopReason.ENCODERS_PART,
    core.WRONG: StopReason.TORQUE_WRONG,
}


class Monitors:
    """Monitors of one machine; a joint without a second signal is not watched."""

    def __init__(self, joints: int, period_s: float, gain: Sequence[float] | None = None):
        """Start monitors that have seen nothing yet."""
        self._record = GuardRecord(joints, period_s)
        set_monitors(self._record, gain, True)

    def told(self, tau: Sequence[float]) -> None:
        """Record the torque that went out (joint,) [N·m]."""
        self._record.put(core.TAU, np.array(tau))
        core.tell(self._record.numbers)

    def look(self, state: JointState, ignored: Collection[int] = ()) -> list[Finding]:
        """Return the findings in a measurement, without those of the joints in `ignored`."""
        record = self._record
        for j in range(record.joints):
            record.numbers[core.ISOLATED + j] = float(j in ignored)
        put_measurement(record, state, state.t)
        core.compare(record.numbers)
        return [(reason, j) for flag, reason in FLAGS.items() for j in sorted(record.joints_at(flag))]

    def is_refused(self, asked: Sequence[float], tau: Sequence[float], v: Sequence[float]) -> bool:
        """Return True if a slow joint was asked for much more torque than went out, for long: [N·m], [rad/s]."""
        for start, values in ((core.HELD, asked), (core.TAU, tau), (core.V_SEEN, v)):
            self._record.put(start, np.array(values))
        return core.is_refused(self._record.numbers)
