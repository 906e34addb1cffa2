"""One control step: the guard looks at a measurement, control answers it, the guard decides, a command results.

Lock-step runs, live processes, fault flights, virtual participants and replays all take this step. They differ in
clock, machine and recording, and in where control runs.
"""

from typing import NamedTuple, Protocol, runtime_checkable

from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, Guard, SafeState
from exograv.safety.stops import StopReason
from exograv.signals import Command, Joints, JointState

CLOSURE_SLOPE_MAX = 0.01
"""Slope of the model's loops from which on the model does not fit the machine [N·m]: a tenth of the smallest target for
the residual torque. A model that fits stays near 1e-12."""

NO_MEASUREMENT = -1
"""Sequence number in a command when the machine sent no measurement."""


@runtime_checkable
class AnsweringControl(Protocol):
    """Control as the step sees it: in this process, in another one, or from a recording."""

    @property
    def closure_slope(self) -> float:
        """Slope of the model's loops, 0 where they are closed or where control did not answer [N·m]."""
        ...

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Answer a measurement that the guard believes; called in every step, also without such a measurement.

        Args:
            believed: The measurement; None if there is none that may be used.
            now: Time on the rig's clock [s].
        """
        ...


class Decision(NamedTuple):
    """Result of one step."""

    believed: JointState | None
    """Measurement that control could answer; None if the guard believed none."""

    submitted: ControlRequest | None
    """Answer of control; None if there was none in time."""

    command: Command
    """Command to write to the machine."""

    safe_state: SafeState
    """Safe state in force."""

    stop: StopReason | None
    """Reason of the stop in force at the decision."""

    closure_slope: float
    """Slope of the model's loops by control's answer [N·m]."""


class ControlStep:
    """The step of one machine, behind its guard."""

    def __init__(self, guard: Guard, gain: Joints):
        """Nothing has been measured yet.

        Args:
            guard: Guard of the machine.
            gain: Torque per motor current, as calibrated (joint,) [N·m/A].
        """
        self.guard, self._gain = guard, gain

    def take(self, state: JointState | None, now: float, control: AnsweringControl) -> Decision:
        """Take one step.

        Args:
            state: Measurement of this period; None if the machine sent none.
            now: Time on the rig's clock [s].
            control: Is asked once, for what the guard believes of the measurement.
        """
        guard = self.guard
        believed = guard.see(state, now)
        submitted = control.answer(believed, now)
        guarded = guard.decide(submitted, now)
        tau, stop, slope = guarded.tau, guard.envelope.stop, control.closure_slope
        # After the decision: the torque of this step was limited already, and the stop begins with the next one.
        if not slope < CLOSURE_SLOPE_MAX:
            guard.lose_model()
        sequence = NO_MEASUREMENT if state is None else state.sequence
        command = Command(now, sequence, now + COMMAND_LIFE_S, tau, tau / self._gain, guarded.drive_damping)
        return Decision(believed, submitted, command, guarded.safe_state, stop, slope)
