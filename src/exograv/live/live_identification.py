"""An arm is learned live: control moves it and tells a worker what was measured, and takes what the worker finds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv import motion
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.prior import prior
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.loop.phases import IDENTIFICATION, VERIFICATION, Phase, phases_of_unknown_arm
from exograv.model.assembly import Assembly
from exograv.motion import Trajectory
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.identification.identify import V_MOTION, identification_motion
from exograv.procedures.verification.postures import NONE, Verification, VerificationPasses, all_passes
from exograv.runtime.control_loop.exchange import sample_dtype
from exograv.runtime.control_loop.worker import WorkerMemory
from exograv.safety.person import PersonLimits
from exograv.signals import Reference

from .arm_worker import ArmWorker

Joints = np.ndarray


class LiveIdentification:
    """Control's part: the motion that is asked for, and what goes to the worker and comes from it."""

    def __init__(
        self,
        assembly: Assembly,
        seconds: float,
        period_s: float,
        tell: Callable[[np.ndarray], object],
        newest: Callable[[], tuple[int, np.void] | None],
        passes: VerificationPasses | None = None,
    ):
        """Before the arm is moved.

        Args:
            assembly: The machine with the arm in it.
            seconds: Of the machine's own motion [s].
            period_s: Of the loop [s].
            tell: Takes a row of `sample_dtype`.
            newest: How many findings there are, and the newest as a row of `finding_dtype`; None before the first.
            passes: Of a verification, from the end of the motion on, when the arm is learned; absent without one.
        """
        self._passes, self._passes_begun_at = passes, np.inf
        self._phases = phases_of_unknown_arm(is_verified=passes is not None)
        self._path, self._period_s = identification_motion(assembly, seconds, period_s), period_s
        self._tell, self._newest = tell, newest
        self._row, self._still = np.zeros((), sample_dtype(assembly.n)), np.zeros(assembly.n)
        self._way = motion.hold(self._path.q[0], 0.0, period_s)
        self._begun_at = 0.0
        self._found_at = -np.inf
        self.findings = 0
        """How many of the worker's are known."""

    def prepare(self, q: Joints) -> None:
        """The arm will be moved from here on [rad]; takes a part of a tick."""
        self._way = IDENTIFICATION.approach(q, self._path.q[0], self._period_s)

    def begin(self, now: float) -> None:
        """The arm is moved from now on [s]."""
        self._begun_at = now

    def phase(self, words: int) -> Phase:
        """Phase in force after so many words of the guard about the person: each driven phase ends with one."""
        return self._phases[min(words, len(self._phases) - 1)]

    def enter(self, phase: Phase, now: float) -> None:
        """Follow the path of the phase from now on [s], if that has not begun."""
        if phase is VERIFICATION and np.isinf(self._passes_begun_at):
            self._passes_begun_at, self._row["is_last"] = now, 0

    def reference(self, now: float) -> Reference:
        """What is asked for at a time [s]; the end of the path after it."""
        if self._passes is not None and now >= self._passes_begun_at:
            return self._at(self._passes.path, self._tick_of_passes(now))
        tick, way, path = self._tick(now), self._way, self._path
        if tick < len(way):
            return Reference(way.q[tick], way.v[tick], way.a[tick])
        return self._at(path, tick - len(way))

    def _at(self, path: Trajectory, tick: int) -> Reference:
        if tick < len(path):
            return Reference(path.q[tick], path.v[tick], path.a[tick])
        return Reference(path.q[-1], self._still, self._still)

    def is_over(self, now: float) -> bool:
        """Whether the motion has come to its end."""
        return self._tick(now) >= len(self._way) + len(self._path)

    def told(self, now: float, q: Joints, tau: Joints, q_asked: Joints) -> None:
        """One tick of the motion: measured position [rad] and torque [N·m], and the position asked for [rad]."""
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
        """What the worker has found since it was last asked; nothing that is older than what is known."""
        newest = self._newest()
        if newest is None or newest[0] == self.findings:
            return None
        self.findings, row = newest
        if row["now"] < self._found_at:
            return None
        self._found_at = float(row["now"])
        return row["x"]

    def _tick(self, now: float) -> int:
        return round((now - self._begun_at) / self._period_s)

    def _tick_of_passes(self, now: float) -> int:
        return round((now - self._passes_begun_at) / self._period_s)


@dataclass(frozen=True)
class LiveIdentificationPlan:
    """What control and worker need to know of it; goes from process to process."""

    assembly: Assembly
    machine: CalibratedMachine
    seconds: float
    period_s: float
    memory: WorkerMemory
    verification: Verification | None = None
    """How it is verified when it is learned."""
    belief: Belief | None = None
    """Of another day, from the person's file; the table's person if absent."""

    def lesson(self) -> LiveIdentification:
        """Control's part, on the memory that its parent has made."""
        samples, findings = self.memory.sample_ring(), self.memory.finding_ring()
        passes = lesson_passes(self.assembly, self.seconds, self.period_s, self.verification)
        return LiveIdentification(self.assembly, self.seconds, self.period_s, samples.put, findings.newest, passes)

    def worker(self) -> "ArmWorker":
        """The worker's part."""
        return ArmWorker(self.assembly, self.machine, self.period_s, self.verification is not None, self.belief)


def lesson_passes(
    assembly: Assembly, seconds: float, period_s: float, verification: Verification | None
) -> VerificationPasses | None:
    """What follows a motion of so many seconds, from where that ends."""
    if verification is None:
        return None
    end = identification_motion(assembly, seconds, period_s).q[-1]
    return all_passes(verification.postures, verification.seed, end, period_s)


def unknown_person(assembly: Assembly, machine: CalibratedMachine) -> PersonLimits:
    """What the guard holds somebody to who is moved and not known yet; seconds pass."""
    return person_believed(assembly, machine, prior(assembly, machine))


def person_believed(assembly: Assembly, machine: CalibratedMachine, belief: Belief) -> PersonLimits:
    """The same of somebody who was here on another day; seconds pass."""
    return LimitsMaker(assembly, machine, belief[0]).expected(*belief, V_MOTION)
