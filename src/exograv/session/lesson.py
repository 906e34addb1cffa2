"""An arm is learned live: control moves it and tells a worker what was measured, and takes what the worker finds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv import motion
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.interface import Estimate, Outcome
from exograv.identification.prior import prior
from exograv.model.assembly import Assembly
from exograv.motion import Trajectory
from exograv.runtime.exchange import sample_dtype
from exograv.runtime.worker import WorkerMemory
from exograv.safety.person import PersonLimits
from exograv.signals import Reference

from .identify import TRAVEL, V_MOTION, identification_motion
from .learner import Belief, Learner, table_guess
from .person_check import PersonCheck
from .verify.listening import Heard, PassListener
from .verify.postures import NONE, Passes, Verification, all_passes
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
        passes: Passes | None = None,
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
        to_path = motion.go_to(q, self._path.q[0], TRAVEL, self._period_s)
        self._way = motion.joined([to_path, motion.hold(self._path.q[0], SETTLE_S, self._period_s)])

    def begin(self, now: float) -> None:
        """The arm is moved from now on [s]."""
        self._begun_at = now

    @property
    def words(self) -> int:
        """About the person, with the last of which all motion is over."""
        return 1 if self._passes is None else 2

    def begin_passes(self, now: float) -> None:
        """The arm is learned and moved on from now on [s], if there are passes and they have not begun."""
        if np.isinf(self._passes_begun_at):
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
class LessonPlan:
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

    def lesson(self) -> Lesson:
        """Control's part, on the memory that its parent has made."""
        samples, findings = self.memory.sample_ring(), self.memory.finding_ring()
        passes = lesson_passes(self.assembly, self.seconds, self.period_s, self.verification)
        return Lesson(self.assembly, self.seconds, self.period_s, samples.put, findings.newest, passes)

    def worker(self) -> "ArmWorker":
        """The worker's part."""
        return ArmWorker(self.assembly, self.machine, self.period_s, self.verification is not None, self.belief)


def lesson_passes(
    assembly: Assembly, seconds: float, period_s: float, verification: Verification | None
) -> Passes | None:
    """What follows a motion of so many seconds, from where that ends."""
    if verification is None:
        return None
    end = identification_motion(assembly, seconds, period_s).q[-1]
    return all_passes(verification.postures, verification.seed, end, period_s)


@dataclass(frozen=True)
class Judged:
    """What a worker tells once a second: how much is known by now, and how much was before anything moved."""

    motion_s: float
    x: Parameters
    sd: Parameters
    """Of each parameter."""
    left_over: Joints
    """That is predicted, per joint over the workspace, RMS [N·m]."""
    prior: Parameters
    prior_sd: Parameters
    left_over_prior: Joints
    is_contradicted: bool = False
    """Whether the motion speaks against the file that it began with."""


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
    is_led: bool = False
    """Whether the arm is moved on."""


@dataclass(frozen=True)
class Passed:
    """What a worker tells after the passes of a verification."""

    t: float
    """The rig's clock at the last sample [s]."""
    heard: tuple[Heard, ...]
    seconds: float
    """That they took [s]."""
    person: PersonLimits
    """As before."""
    is_led: bool = False
    """The arm is let go."""


class ArmWorker:
    """`Working`: learns the arm by the recursive method, works out what may reach it, and listens to a verification."""

    def __init__(
        self,
        assembly: Assembly,
        machine: CalibratedMachine,
        period_s: float,
        is_verified: bool = False,
        belief: Belief | None = None,
    ):
        """Takes seconds; `belief` is of another day, and is held against the first seconds of motion."""
        self._period_s, self._before = period_s, -np.inf
        self._is_verified, self._learned, self._is_passed = is_verified, None, False
        self._listener, self._begun_at = PassListener(assembly.n, period_s), np.inf
        self._learner = Learner(assembly, machine, "recursive", period_s, belief)
        self._limits = LimitsMaker(assembly, machine, table_guess(assembly, machine))
        self._check: PersonCheck | None = None
        if belief is not None:
            self._check = PersonCheck(self._learner.model.again(), machine, belief, prior(assembly, machine))
            self._learner.followers.append(self._check.take)
        self._news: list[Judged] = []

    def news(self) -> list[Judged]:
        """As it was judged since this was last asked."""
        news, self._news = self._news, []
        return news

    def take(self, sample: np.void) -> np.ndarray | None:
        """One sample; what may be published, if it is time."""
        now = float(sample["now"])
        ticks = 1 if np.isinf(self._before) else round((now - self._before) / self._period_s)
        self._before = now
        is_broken = not 0 <= ticks <= BRIDGED_TICKS
        ticks = 1 if is_broken else ticks
        if self._learned is not None:
            self._listen(sample, ticks, is_broken)
            return None
        if is_broken:
            self._learner.interrupt()
        found = None
        for _ in range(ticks):
            estimate = self._learner.take(sample["q"], sample["tau"], sample["q_asked"])
            if estimate is not None:
                found = estimate.x
                if self._learner.is_to_note:
                    self._judge(estimate)
        return found

    def _listen(self, sample: np.void, ticks: int, is_broken: bool) -> None:
        listener, posture = self._listener, int(sample["posture"])
        if is_broken:
            listener.interrupt()
        self._begun_at = min(self._begun_at, self._before)
        if posture != (NONE if listener.posture is None else listener.posture):
            listener.begin(None if posture == NONE else posture)
        for _ in range(ticks):
            listener.take(sample["q"], sample["tau"], sample["q_asked"])

    @property
    def is_over(self) -> bool:
        """Whether nothing follows."""
        return self._is_passed or not self._is_verified

    def finish(self) -> tuple[np.ndarray, Learned | Passed]:
        """Parameters, and what the parent is to know."""
        if self._learned is not None:
            self._is_passed = True
            heard, seconds = tuple(self._listener.heard), self._before - self._begun_at
            return self._learned.estimate.x, Passed(self._before, heard, seconds, self._learned.person)
        self._learned = self._arm()
        return self._learned.estimate.x, self._learned

    def _judge(self, estimate: Estimate) -> None:
        left_over = self._learner.judge(estimate)
        if left_over is not None:
            is_other = self._check is not None and self._check.is_contradicted
            self._news.append(Judged(estimate.t, estimate.x, estimate.sd, left_over, *self._learner.before, is_other))

    def _arm(self) -> Learned:
        estimate = self._learner.last()
        self._judge(estimate)
        found = self._learner.close()
        person = self._limits.known(estimate.x)
        why = (found.outcome, found.why, found.stop_s, found.restless_s)
        return Learned(self._before, estimate, *why, person, self._is_verified)


def unknown_person(assembly: Assembly, machine: CalibratedMachine) -> PersonLimits:
    """What the guard holds somebody to who is moved and not known yet; seconds pass."""
    return person_believed(assembly, machine, prior(assembly, machine))


def person_believed(assembly: Assembly, machine: CalibratedMachine, belief: Belief) -> PersonLimits:
    """The same of somebody who was here on another day; seconds pass."""
    return LimitsMaker(assembly, machine, belief[0]).expected(*belief, V_MOTION)
