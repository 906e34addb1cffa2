"""Flight of healthy use in native code: stops, findings of the drift monitor, and torques outside the envelope."""

import numpy as np
from jaxtyping import Float

from exograv.loop.control_step import ControlStep
from exograv.loop.drift_monitor import DriftMonitor
from exograv.loop.native_ticks import NativeTicks
from exograv.loop.output_feedback import OutputFeedback
from exograv.motion import Trajectory
from exograv.rig.twin import TwinDivergedError
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.person import GuardedPerson
from exograv.safety.stops import StopReason
from exograv.signals import JointState, Reference

from .fault_plant import FaultParticipant, FlightStart, SwayingWearer, twin_of
from .flight import KEPT_TICKS, SEGMENT_TICKS
from .oracle import EnvelopeOracle
from .scenario_log import ScenarioLog

Joints = Float[np.ndarray, " joint"]


class NativeHealthyFlight:
    """Healthy flight on the twin: the ticks of `FaultFlight` without faults."""

    def __init__(self, participant: FaultParticipant, start: FlightStart):
        """Begin with the arm floating in the posture of the start."""
        prepared, gain = participant.prepared, participant.prepared.machine.actuators.gain
        self.twin = twin_of(participant.laboratory, start, prepared.t)
        """Machine and wearer, for examiners."""
        period_s = self.twin.period_s
        self._wearer, self._gain = SwayingWearer(self.twin, start), gain
        self._moves = bool(start.moves.any())
        self._controller = controller = participant.controller.again(prepared.x)
        self._envelope = envelope = Envelope(participant.limits, period_s)
        envelope.person = self._person = GuardedPerson(participant.person)
        envelope.begin(controller.torque_at_rest(start.posture, prepared.x))
        guard = Guard.of_machine(envelope, period_s, gain.tolist())
        self._step, self._feedback = ControlStep(guard, gain), OutputFeedback(len(gain), period_s, controller)
        self._drift = DriftMonitor(controller, prepared.covariance, period_s, participant.model)
        self._native = NativeTicks.of(self.twin, guard, gain)
        self._oracle = EnvelopeOracle(participant.limits, participant.person, period_s)
        self._judged, self._tau = 0, np.empty(len(gain))
        still = np.zeros((1, len(gain)))
        self._path = Trajectory(start.posture[None].copy(), still, still, period_s)
        self._reference = Reference(start.posture, still[0], still[0])
        self.is_native = False
        """True if the ticks run in native code; the first ones never do."""

    def fly(self, ticks: int) -> ScenarioLog:
        """Fly this number of ticks, or to the first stop; the log states an exception.

        The envelope's oracle judges all ticks but that of the stop: which joints were isolated when the guard accepted
        its measurement is not known outside of native code.
        """
        course, envelope = ScenarioLog(), self._envelope
        try:
            for tick in range(ticks):
                believed = self._tick()
                course.ticks += 1
                self._look_for_drift(tick, believed, course)
                if envelope.stop is not None:
                    course.stopped_tick, course.reason = tick, envelope.stop
                    break
                self._oracle.note(self._tau.copy(), believed and believed.q, frozenset(), self._person.gravity_level)
                if course.ticks % SEGMENT_TICKS == 0:
                    self._judge(course)
        except Exception as error:  # noqa: BLE001 - a crash of the software is a finding of the campaign
            course.crashed = f"{type(error).__name__}: {error}"
            course.diverged = isinstance(error, TwinDivergedError)
        self._judge(course)
        return course

    def _judge(self, course: ScenarioLog) -> None:
        """Judge the ticks since the last judgement, and forget all but the last ones."""
        wrong = [what for tick, what in self._oracle.judge().wrong.items() if tick >= self._judged]
        course.violated_ticks += len(wrong)
        course.violations += wrong[: 3 - len(course.violations)]
        self._oracle.forget(KEPT_TICKS)
        self._judged = self._oracle.ticks

    def _tick(self) -> JointState | None:
        twin, native = self.twin, self._native
        if self._moves:
            self._wearer.sway()
        if native is not None and not self.is_native:
            self.is_native = native.begin(self._feedback, self._controller, self._path)
        if native is not None and self.is_native:
            believed = native.run(0, self._reference, 0, None)
            self._step.check_model(self._controller.closure_slope)
            self._tau = native.tau_commanded
            return believed
        state = twin.read()
        self._feedback.reference = self._reference
        decision = self._step.take(state, twin.t, self._feedback)
        twin.write(decision.command._replace(sequence=state.sequence))
        self._tau = decision.command.tau
        return decision.believed

    def _look_for_drift(self, tick: int, believed: JointState | None, course: ScenarioLog) -> None:
        if believed is None or self._envelope.stop is not None:
            return
        finding = self._drift.take(believed.q, self._gain * believed.current)
        if finding is None:
            return
        if finding.stops:
            self._envelope.trip(StopReason.DRIFTED)
        elif course.told_tick is None:
            course.told_tick = tick
