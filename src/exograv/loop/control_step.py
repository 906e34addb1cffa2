"""Control step: the guard checks a measurement, control answers, the guard decides, and a command results.

Lock-step runs, live processes, fault flights, virtual participants and replays all use this step. They differ in
clock, machine and recording, and in the process that runs control.
"""

from typing import NamedTuple, Protocol, runtime_checkable

from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest, Guard, SafeState
from exograv.safety.stops import StopReason
from exograv.signals import Command, Joints, JointState

CLOSURE_SLOPE_MAX = 0.01
"""Limit of the remaining gradient of the closure (`Closure.slope`, summed over freedoms) [N·m]. Above the limit the
model's loops are not closed, and the model does not fit the machine. The limit is a tenth of the smallest target for
the residual torque; a model that fits stays near 1e-12."""

NO_MEASUREMENT = -1
"""Sequence number in a command when the machine sent no measurement."""


@runtime_checkable
class AnsweringControl(Protocol):
    """Interface of control to the step. Control runs in this process, in another one, or comes from a recording."""

    @property
    def closure_slope(self) -> float:
        """Remaining gradient of the closure [N·m]; 0 if the loops are closed, or if control did not answer."""
        ...

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Answer a measurement that the guard trusts. Called in every step, also without such a measurement.

        Args:
            believed: The measurement; None if no usable measurement exists.
            now: Time on the rig's clock [s].
        """
        ...


class Decision(NamedTuple):
    """Result of one step."""

    believed: JointState | None
    """Measurement for control; None if the guard rejected it or none arrived."""

    submitted: ControlRequest | None
    """Answer of control; None if no answer came in time."""

    command: Command
    """Command to write to the machine."""

    safe_state: SafeState
    """Safe state in force."""

    stop: StopReason | None
    """Reason of the stop in force at the decision."""

    closure_slope: float
    """Remaining gradient of the closure in control's answer [N·m]."""


class ControlStep:
    """Control step of one machine, behind its guard."""

    def __init__(self, guard: Guard, gain: Joints):
        """Prepare the step. No measurement has arrived yet.

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
            control: Called once, with the measurement as the guard accepts it.
        """
        guard = self.guard
        believed = guard.see(state, now)
        submitted = control.answer(believed, now)
        guarded = guard.decide(submitted, now)
        tau, stop, slope = guarded.tau, guard.envelope.stop, control.closure_slope
        self.check_model(slope)
        sequence = NO_MEASUREMENT if state is None else state.sequence
        command = Command(now, sequence, now + COMMAND_LIFE_S, tau, tau / self._gain, guarded.drive_damping)
        return Decision(believed, submitted, command, guarded.safe_state, stop, slope)

    def check_model(self, closure_slope: float) -> None:
        """Report to the guard that control's model no longer fits the machine, if its loops are not closed [N·m].

        Call it after the decision: this step's torque is limited already, and the stop begins with the next step.
        """
        if not closure_slope < CLOSURE_SLOPE_MAX:
            self.guard.lose_model()
