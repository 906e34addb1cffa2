"""Live identification of an arm: control moves the arm, sends samples to a worker and takes its estimates."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.prior import prior
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.loop.phases import IDENTIFICATION, VERIFICATION, Phase, phases_of_unknown_arm
from exograv.model.assembly import Assembly
from exograv.motion import Passage, Trajectory
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.identification.identify import V_MOTION, identification_motion, planned_check
from exograv.procedures.verification.postures import NONE, Verification, VerificationPasses, all_passes
from exograv.runtime.control_loop.exchange import sample_dtype
from exograv.runtime.control_loop.worker import WorkerMemory
from exograv.safety.limits import PersonLimits
from exograv.signals import Reference

from .arm_worker import ArmWorker

Joints = np.ndarray


class LiveIdentification:
    """Part of control: the reference motion, samples to the worker, and estimates from the worker."""

    def __init__(
        self,
        assembly: Assembly,
        seconds: float,
        period_s: float,
        tell: Callable[[np.ndarray], object],
        newest: Callable[[], tuple[int, np.void] | None],
        passes: VerificationPasses | None = None,
    ):
        """Prepare the motion.

        Args:
            assembly: The machine with the arm in it.
            seconds: Duration of the machine's own motion [s].
            period_s: Period of the loop [s].
            tell: Function that sends a row of `sample_dtype` to the worker.
            newest: Function that returns the number of findings and the newest as a row of `finding_dtype`; None before
                the first.
            passes: Passes of a verification after the motion, when the arm is learned; None without a verification.
        """
        self._passes, self._passes_begun_at = passes, np.inf
        self._phases = phases_of_unknown_arm(is_verified=passes is not None)
        self._path, self._period_s = identification_motion(assembly, seconds, period_s), period_s
        self._tell, self._newest = tell, newest
        self._row, self._still = np.zeros((), sample_dtype(assembly.n)), np.zeros(assembly.n)
        self._way = Passage(self._path.q[0], self._path.q[0], 0, 0, period_s)
        self._begun_at = 0.0
        self._found_at = -np.inf
        self.findings = 0
        """Number of findings of the worker that control knows."""

    def prepare(self, q: Joints) -> None:
        """Plan the approach from the posture `q` [rad]."""
        self._way = IDENTIFICATION.passage(q, self._path.q[0], self._period_s)

    def begin(self, now: float) -> None:
        """Begin the motion at time `now` [s]."""
        self._begun_at = now

    def phase(self, words: int) -> Phase:
        """Phase after `words` updates of the person at the guard: an update ends each driven phase."""
        return self._phases[min(words, len(self._phases) - 1)]

    def enter(self, phase: Phase, now: float) -> None:
        """Begin the path of the phase at time `now` [s], if it has not begun."""
        if phase is VERIFICATION and np.isinf(self._passes_begun_at):
            self._passes_begun_at, self._row["is_last"] = now, 0

    def reference(self, now: float) -> Reference:
        """Return the reference at a time [s]; after the path it stays at the end."""
        if self._passes is not None and now >= self._passes_begun_at:
            return self._at(self._passes.path, self._tick_of_passes(now))
        tick, way, path = self._tick(now), self._way, self._path
        if tick < len(way):
            return Reference(*way.at(tick))
        return self._at(path, tick - len(way))

    def _at(self, path: Trajectory, tick: int) -> Reference:
        if tick < len(path):
            return Reference(path.q[tick], path.v[tick], path.a[tick])
        return Reference(path.q[-1], self._still, self._still)

    def is_over(self, now: float) -> bool:
        """Return True if the motion has ended."""
        return self._tick(now) >= len(self._way) + len(self._path)

    def told(self, now: float, q: Joints, tau: Joints, q_asked: Joints) -> None:
        """Send one tick of the motion: measured position [rad] and torque [N·m], and reference position [rad]."""
        tick, path, row = self._tick(now) - len(self._way), self._path, self._row
        row["posture"] = NONE
        if self._passes is not None and now >= self._passes_begun_at:
            tick, path = self._tick_of_passes(now), self._passes.path
            row["posture"] = self._passes.posture[min(tick, len(path) - 1)]
        if 0 <= tick < len(path):
            row["now"], row["is_last"] = now, 0
            row["q"], row["tau"], row["q_asked"] = q, tau, q_asked
            self._tell(row)
        elif tick >= len(path) and not row["is_last"]:
            row["is_last"] = 1
            self._tell(row)

    def found(self) -> Parameters | None:
        """Return the worker's newest estimate; None if it is not newer than the last one, or not finite."""
        newest = self._newest()
        if newest is None or newest[0] == self.findings:
            return None
        self.findings, row = newest
        if not row["now"] >= self._found_at or not np.isfinite(row["x"]).all():
            return None
        self._found_at = float(row["now"])
        return row["x"]

    def _tick(self, now: float) -> int:
        return round((now - self._begun_at) / self._period_s)

    def _tick_of_passes(self, now: float) -> int:
        return round((now - self._passes_begun_at) / self._period_s)


@dataclass(frozen=True)
class LiveIdentificationPlan:
    """Plan of a live identification, which is sent to the processes of control and worker."""

    assembly: Assembly
    machine: CalibratedMachine
    seconds: float
    period_s: float
    memory: WorkerMemory
    verification: Verification | None = None
    """Verification after the identification."""
    belief: Belief | None = None
    """Belief of an earlier day from the participant's file; None for the prior of the body-segment table."""
    body_mass_kg: float | None = None
    """Body mass on the form, with which an unknown arm is compared [kg]; None to compare nothing."""

    def lesson(self) -> LiveIdentification:
        """Build the part of control on the shared memory of the parent process."""
        samples, findings = self.memory.sample_ring(), self.memory.finding_ring()
        passes = lesson_passes(self.assembly, self.seconds, self.period_s, self.verification)
        return LiveIdentification(self.assembly, self.seconds, self.period_s, samples.put, findings.newest, passes)

    def worker(self) -> "ArmWorker":
        """Build the part of the worker."""
        is_verified = self.verification is not None
        check = planned_check(self.assembly, self.seconds)
        return ArmWorker(self.assembly, self.machine, self.period_s, is_verified, self.belief, self.body_mass_kg, check)


def lesson_passes(
    assembly: Assembly, seconds: float, period_s: float, verification: Verification | None
) -> VerificationPasses | None:
    """Return the passes of a verification, from the posture in which a motion of `seconds` [s] ends."""
    if verification is None:
        return None
    end = identification_motion(assembly, seconds, period_s).q[-1]
    return all_passes(verification.postures, verification.seed, end, period_s)


def unknown_person(assembly: Assembly, machine: CalibratedMachine) -> PersonLimits:
    """Limits of an unknown person whom the machine moves. The computation takes seconds."""
    return person_believed(assembly, machine, prior(assembly, machine))


def person_believed(assembly: Assembly, machine: CalibratedMachine, belief: Belief) -> PersonLimits:
    """Limits of a person from a belief of an earlier day, while the machine moves the arm. This takes seconds."""
    return LimitsMaker(assembly, machine, belief[0]).expected(*belief, V_MOTION)
