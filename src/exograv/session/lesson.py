"""An arm is learned live: control moves it and tells a worker what was measured, and takes what the worker finds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv import motion
from exograv.control.governor import Governor
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.interface import Estimate, Outcome
from exograv.identification.prior import prior
from exograv.model.assembly import Assembly
from exograv.runtime.exchange import sample_dtype
from exograv.runtime.worker import WorkerMemory
from exograv.safety.person import PersonLimits
from exograv.signals import Reference

from .identify import TRAVEL, V_MOTION, identification_motion
from .learner import Learner, table_guess
from .worn import LimitsMaker

SETTLE_S = 0.5
"""Before the motion, at its first posture."""

BRIDGED_TICKS = 20
"""Up to so many missing samples the one after them stands for all; a longer gap breaks the motion off."""

Joints = np.ndarray


class Lesson:
    """Control's part: the motion that is asked for, and what goes to the worker and comes from it."""

    def __init__(
        self,
        assembly: Assembly,
        seconds: float,
        period_s: float,
        tell: Callable[[np.ndarray], object],
        newest: Callable[[], tuple[int, np.void] | None],
    ):
        """Before the arm is moved.

        Args:
            assembly: The machine with the arm in it.
            seconds: Of the machine's own motion [s].
            period_s: Of the loop [s].
            tell: Takes a row of `sample_dtype`.
            newest: How many findings there are, and the newest as a row of `finding_dtype`; None before the first.
        """
        self._path, self._period_s = identification_motion(assembly, seconds, period_s), period_s
        self._tell, self._newest = tell, newest
        self._row, self._still = np.zeros((), sample_dtype(assembly.n)), np.zeros(assembly.n)
        self._way = motion.hold(self._path.q[0], 0.0, period_s)
        self._kp = assembly.description.per_actuator("weak_kp_Nm_per_rad")
        self._governor = Governor(self._kp, period_s)
        self._now = 0.0
        self._found_at = -np.inf
        self.findings = 0
        """How many of the worker's are known."""

    def prepare(self, q: Joints) -> None:
        """The arm will be moved from here on [rad]; takes a part of a tick."""
        to_path = motion.go_to(q, self._path.q[0], TRAVEL, self._period_s)
        self._way = motion.joined([to_path, motion.hold(self._path.q[0], SETTLE_S, self._period_s)])

    def begin(self, now: float) -> None:
        """The arm is moved from now on [s]."""
        self._governor, self._now = Governor(self._kp, self._period_s), now

    def reference(self, now: float, q: Joints) -> Reference:
        """What is asked for at a time [s] of an arm that is at `q` [rad]; the end of the path after it."""
        ticks = min(round((now - self._now) / self._period_s), BRIDGED_TICKS)
        self._now = now
        self._governor.step(ticks)
        return self._at(q)

    @property
    def is_over(self) -> bool:
        """Whether the motion has come to its end."""
        return self._tick() >= len(self._path)

    @property
    def gives_up(self) -> bool:
        """Whether the arm does not come along."""
        return self._governor.gives_up and not self.is_over

    def told(self, now: float, q: Joints, tau: Joints, q_asked: Joints) -> None:
        """One tick of the motion: measured position [rad] and torque [N·m], and the position asked for [rad]."""
        tick = self._tick()
        if 0 <= tick < len(self._path):
            row = self._row
            row["now"], row["is_last"] = now, 0
            row["q"], row["tau"], row["q_asked"] = q, tau, q_asked
            self._tell(row)
        elif tick >= len(self._path) and not self._row["is_last"]:
            self._row["is_last"] = 1
            self._tell(self._row)

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

    def _tick(self) -> float:
        """Where on the path the arm should be; below 0 on the way to it [ticks]."""
        return self._governor.at - len(self._way)

    def _at(self, q: Joints) -> Reference:
        """What is asked for there."""
        if self._tick() < 0:
            # By the clock: while nobody learns, what keeps an arm off its path stays, and would keep it off for ever.
            way, k = self._way, int(self._governor.at)
            return Reference(way.q[k], way.v[k], way.a[k])
        if self.is_over:
            return Reference(self._path.q[-1], self._still, self._still)
        return self._governor.reference(self._path, q, len(self._way))


@dataclass(frozen=True)
class LessonPlan:
    """What control and worker need to know of it; goes from process to process."""

    assembly: Assembly
    machine: CalibratedMachine
    seconds: float
    period_s: float
    memory: WorkerMemory

    def lesson(self) -> Lesson:
        """Control's part, on the memory that its parent has made."""
        samples, findings = self.memory.sample_ring(), self.memory.finding_ring()
        return Lesson(self.assembly, self.seconds, self.period_s, samples.put, findings.newest)

    def worker(self) -> "ArmWorker":
        """The worker's part."""
        return ArmWorker(self.assembly, self.machine, self.period_s)


@dataclass(frozen=True)
class Learned:
    """What a worker tells in the end."""

    t: float
    """The rig's clock at the last sample [s]."""
    estimate: Estimate
    outcome: Outcome
    why: str
    stop_s: float | None
    """When the stop rule would have ended the motion [s]."""
    restless_s: float | None
    person: PersonLimits
    """What the guard is to hold this person to."""


class ArmWorker:
    """`Working`: learns the arm by the recursive method, and works out what may reach it."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, period_s: float):
        """Takes seconds."""
        self._period_s, self._before = period_s, -np.inf
        self._learner = Learner(assembly, machine, "recursive", period_s)
        self._limits = LimitsMaker(assembly, machine, table_guess(assembly, machine))

    def take(self, sample: np.void) -> np.ndarray | None:
        """One sample; what may be published, if it is time."""
        now = float(sample["now"])
        ticks = 1 if np.isinf(self._before) else round((now - self._before) / self._period_s)
        self._before = now
        if not 0 <= ticks <= BRIDGED_TICKS:
            self._learner.interrupt()
            ticks = 1
        found = None
        for _ in range(ticks):
            estimate = self._learner.take(sample["q"], sample["tau"], sample["q_asked"])
            if estimate is not None:
                found = estimate.x
                if self._learner.is_to_note:
                    self._learner.judge(estimate)
        return found

    def finish(self) -> tuple[np.ndarray, Learned]:
        """Parameters, and what the parent is to know."""
        estimate = self._learner.last()
        self._learner.judge(estimate)
        found = self._learner.close()
        person = self._limits.known(estimate.x)
        why = (found.outcome, found.why, found.stop_s, found.restless_s)
        return estimate.x, Learned(self._before, estimate, *why, person)


def unknown_person(assembly: Assembly, machine: CalibratedMachine) -> PersonLimits:
    """What the guard holds somebody to who is moved and not known yet; seconds pass."""
    mean, covariance = prior(assembly, machine)
    return LimitsMaker(assembly, machine, mean).expected(mean, covariance, V_MOTION)
