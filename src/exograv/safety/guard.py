"""Guard between control and the machine: checks measurements and torques.

If they are missing for a short time, the guard holds the last valid torque. If they are missing for longer, it lets
the arm down softly. It needs no model and no control.
"""

import enum
import math
from collections.abc import Sequence
from typing import NamedTuple

from exograv.signals import Joints, JointState

from .envelope import Envelope
from .ingress import COARSEST_COUNT_RAD, PLACES, Ingress, put_measurement
from .monitors import set_monitors
from .native import core
from .period import ticks_of

COMMAND_LIFE_S = 0.005
"""Time after which a command that was not replaced is void [s] (docs/explanation/safety.md, SS0)."""

WINDOW_MS, IN_WINDOW_MAX_MS = 20, 3
"""Window [ms], and the time of missed ticks in it that the last valid torque bridges [ms].

The limit also holds for missed ticks in a row. The next missed tick ends the bridge.
"""

SECOND_MS, IN_SECOND_MAX = 1000, core.IN_SECOND_MAX
"""Window [ms], and the largest number of missed ticks in it that the last valid torque bridges, at any period."""

GRAVITY_LEVEL_S, GRAVITY_LEVEL_MAX = core.GRAVITY_LEVEL_S, core.GRAVITY_LEVEL_MAX

CONSENT_S = 120.0
"""Time for which one consent of the wearer allows levels above 1 [s]: a parabola with its two pull-ups takes 82 s."""


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


class ControlRequest(NamedTuple):
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


SAFE_STATES = {state.value: state for state in SafeState}


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
        self.envelope, self._record, self._period_s = envelope, envelope.record, period_s
        record = self._record
        record.take(ingress.record, PLACES)
        ingress.record = record
        set_monitors(record, gain, compares)
        r = record.numbers
        r[core.WINDOW], r[core.SECOND] = ticks_of(WINDOW_MS, period_s), ticks_of(SECOND_MS, period_s)
        r[core.IN_WINDOW] = ticks_of(IN_WINDOW_MAX_MS, period_s)

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
        put_measurement(self._record, state, now)
        self._record.tick.see()
        return state if self._record.numbers[core.USABLE] != 0.0 else None

    def decide(self, submitted: ControlRequest | None, now: float) -> Guarded:
        """Run the second half of a tick: decide what goes out, with or without an answer of control."""
        record = self._record
        r = record.numbers
        r[core.NOW] = now
        if submitted is None:
            r[core.SPOKE] = 0.0
        else:
            r[core.SPOKE], r[core.ANSWERS], r[core.VALID_UNTIL] = 1.0, submitted.sequence, submitted.valid_until
            record.answer_in[:] = submitted.tau
        record.tick.decide()
        return Guarded(record.tau.copy(), self.envelope.drive_damping, self.safe_state)

    @property
    def safe_state(self) -> SafeState:
        """Safe state of the last tick."""
        return SAFE_STATES[int(self._record.numbers[core.SAFE_STATE])]

    def lose_model(self) -> None:
        """Start a soft descent because control's model no longer fits the machine.

        A torque for another posture is arbitrary.
        """
        core.trip(self._record.numbers, core.MODEL_LOST, False)

    def press_stop(self) -> None:
        """Start a soft descent because a person pressed Stop."""
        core.trip(self._record.numbers, core.STOP_PRESSED, False)

    def feel(self, gravity_level: float, ramp_s: float = 0.0) -> bool:
        """Lead the gravity level that the person feels to this value by a ramp, from the next tick on.

        The ramp takes `ramp_s`, or longer if it would be steeper than allowed. Above level 1 the arm is pushed down,
        where posture and speed allow it, and until the wearer's consent runs out.

        Returns:
            True if the request is accepted. It is refused while control moves the arm along a path, after a stop, and
            above level 1 without the wearer's consent.
        """
        person = self.envelope.person
        if person is None or person.is_driven or self.envelope.stop is not None:
            return False
        r = self._record.numbers
        most = GRAVITY_LEVEL_MAX if r[core.CONSENT] > 0.0 else 1.0
        if not (0.0 <= gravity_level <= most and 0.0 <= ramp_s < math.inf):
            return False
        step = self._period_s / GRAVITY_LEVEL_S
        if ramp_s > 0.0:
            step = min(step, abs(gravity_level - person.gravity_level) * self._period_s / ramp_s)
        r[core.LEVEL_WANTED], r[core.LEVEL_STEP], r[core.LEVEL_MOVES] = gravity_level, step, 1.0
        return True

    def consent(self, seconds: float = CONSENT_S) -> bool:
        """Allow levels above 1 for this time: the wearer agrees that the arm is pushed down.

        A later consent replaces the one before; 0 withdraws it. When it runs out, the level goes back to 1 by a ramp.

        Returns:
            True if the consent is accepted. It is refused without a person, after a stop, and above `CONSENT_S`.
        """
        if self.envelope.person is None or self.envelope.stop is not None or not 0.0 <= seconds <= CONSENT_S:
            return False
        self._record.numbers[core.CONSENT] = seconds
        return True

    @property
    def consent_s(self) -> float:
        """Time for which the wearer still agrees to levels above 1 [s]."""
        return self._record.numbers[core.CONSENT]

    def reset(self) -> bool:
        """Leave the latched stop, and return True if that was possible.

        It is not possible while the arm comes down, while a joint moves, or while the machine sends no measurement.
        """
        return bool(self._record.tick.reset())
