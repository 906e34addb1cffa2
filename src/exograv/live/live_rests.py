"""Rests of a live session in which the machine moves the relaxed arm and learns it."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from exograv.identification.core.interface import Covariance, Sample
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.loop.phases import REST_LEARNING
from exograv.model.arm import is_plausible
from exograv.motion import Planned
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.rest_learning import RestLearned, Verdict, rest_motion
from exograv.procedures.identification.rest_text import RestPhase
from exograv.procedures.identification.session_watch import MeansListener
from exograv.runtime.processes.supervisor import Supervisor
from exograv.safety.limits import PersonLimits
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import CheckedArm

from .arm_worker import LearnedArm
from .live_procedure import LiveFloat
from .order_line import OrderLine
from .rest_process import ArmRefused, ReadyToLearn, RestJob, RestReport, rest_process

LEARNS_WITHIN_S = 30.0
"""Longest time for which the arm is held while the process learns [s]. The result is then given up."""

ANSWERED_ROWS = 2
"""Ticks of an order after which control has put its arm into force: it does so after the answer to the first."""

LEADS_S = 2.0
"""Time for the ramps of the feedback at both ends of the motion [s]."""

ENDS_S = 2.0
"""Time-out for the process to end by itself [s]."""

Joints = np.ndarray

RestProgress = Callable[[RestPhase, float], object]
"""Function that takes the phase, and the time of the motion that is done [s]."""


class LiveRests:
    """Arm of a session, as it is known from its identification and from the rests. One thread at a time uses it."""

    def __init__(self, prepared: ControllerKnowledge, line: OrderLine, period_s: float, before: RestsSoFar):
        """Prepare the limits of the person, which takes a second.

        Args:
            prepared: Machine with the arm in it.
            line: Orders to control.
            period_s: Period of the machine [s].
            before: Rests of the session from before the machine took the arm.
        """
        self._prepared, self._line, self._period_s = prepared, line, period_s
        self._limits = LimitsMaker(prepared.assembly, prepared.machine, prepared.x)
        self._process: Supervisor[RestJob] | None = None
        self._has_begun = self._is_forgotten = self._has_given_up = self._is_report_due = False
        self._x = self._identified = prepared.x
        self._covariance: Covariance = np.zeros((0, 0))
        self.so_far = before
        """Rests of the session as of the newest report of the process."""
        self.rests = before.rests
        """Number of motions so far."""
        self.stated_before_Nm: Joints | None = None
        """Residual torque that the arm stated before the first rest [N·m]; None before the process is ready."""
        self.newest: RestLearned | None = None
        """Result of the last rest; None before the first."""
        self.checked: CheckedArm | None = None
        """Estimate of the last complete rest for the participant's file; None before a rest gave one."""
        self.has_other_limits = False
        """True while the guard has other limits than those of the carried arm that floats, as during a motion."""

    @property
    def is_ready(self) -> bool:
        """True if the process can learn."""
        return self.stated_before_Nm is not None and not self.has_failed and not self._is_report_due

    @property
    def has_failed(self) -> bool:
        """True if the process has failed, or the learned arm is none from which rests can go on."""
        return self._has_begun and (self._process is None or self._has_given_up or self._process.has_hung_up)

    @property
    def stated_Nm(self) -> Joints | None:
        """Residual torque that the carried arm states now [N·m]; None before the process is ready."""
        return self.stated_before_Nm if self.newest is None else self.newest.stated_Nm

    def begin(self, learned: LearnedArm) -> None:
        """Start the process for an arm that is learned and floats. Without a stated uncertainty there is none."""
        if self._has_begun:
            return
        self._has_begun, estimate, carried = True, learned.estimate, learned.carried
        # Control and guard keep the table's arm in place of an implausible one.
        is_carried = is_plausible(self._prepared.assembly.arm, carried.x)
        if estimate.covariance is not None and is_carried:
            self._x = self._identified = carried.x
            machine, belief = self._prepared.machine, (estimate.x, estimate.covariance)
            job = RestJob(self._prepared.assembly, machine, carried.x, belief, self.so_far)
            self._process = Supervisor("rests", rest_process, job)

    def look(self) -> None:
        """Take the message that the process is ready. Call it several times a second, except during a motion.

        A rest may have ended before its report: the process then learns that the machine carries the arm from before.
        """
        if self._process is None or (self.stated_before_Nm is not None and not self._is_report_due):
            return
        for word in self._process.heard():
            if isinstance(word, ReadyToLearn):
                self.stated_before_Nm, self._covariance = word.stated_Nm, word.covariance
            elif isinstance(word, RestReport):
                self._is_report_due, self.so_far = False, word.so_far
                if word.learned.verdict is Verdict.TAKEN:
                    self._process.send(ArmRefused(self._x, self._covariance))
                else:
                    self._covariance = word.covariance

    def close(self) -> None:
        """Stop the process that learns."""
        if self._process is not None:
            self._process.end(ENDS_S)

    def forget(self) -> None:
        """Return to the identified arm: a control that was started again carries that one, and no rest's."""
        if self._has_begun and not self._is_forgotten:
            self._is_forgotten, self.has_other_limits, self._x = True, True, self._identified
            self._give_up()

    def motion_s(self, q: Joints) -> float:
        """Duration of the next motion from the posture `q` [rad] and back [s], without the computation."""
        path, way = self._paths(q)
        return self._period_s * (len(path) + 2 * len(way)) + LEADS_S

    def known(self) -> PersonLimits:
        """Limits of the carried arm while it floats."""
        return self._limits.known(self._x)

    def perform(self, machine: LiveFloat, progress: RestProgress) -> RestLearned | None:
        """Move the floating arm, learn it, move it back, put a better arm into force, and let it float.

        Returns:
            Result of the rest; None if the process has failed or was too slow. The arm in force then stays, as does
            `checked`.

        Raises:
            RigError: The machine was stopped or gave the arm back, or the run is over.
        """
        home = machine.q
        path, way = self._paths(home)
        machine.wear(self._limits.expected(self._x, self._covariance, V_MOTION), is_driven=True)
        self.has_other_limits = True
        self._order(machine, is_led=True)
        while machine.drive < 1.0:
            machine.wait()
        done_s = self._follow(machine, way, RestPhase.WAY, progress, 0.5 * LEADS_S)
        listener = MeansListener(len(home), self._period_s)

        def hear(tick: int, q: Joints, tau: Joints) -> None:
            listener.take(q, tau, path.at(tick)[0])

        done_s = self._follow(machine, path, RestPhase.MOVES, progress, done_s, hear)
        self._send(listener.samples)
        back = REST_LEARNING.passage(path.at(len(path) - 1)[0], home, self._period_s)
        done_s = self._follow(machine, back, RestPhase.BACK, progress, done_s)
        progress(RestPhase.LEARNS, done_s)
        report = self._heard(machine)
        learned = self._put_into_force(machine, report)
        self.newest = learned or self.newest
        progress(RestPhase.FLOATS, done_s)
        self._order(machine, is_led=False)
        while machine.drive > 0.0:
            machine.wait()
        machine.wear(self.known(), is_driven=False)
        self.has_other_limits = False
        if report is not None and learned is not None and learned.verdict is report.learned.verdict:
            self.checked = report.checked
        return learned

    def _paths(self, q: Joints) -> tuple[Planned, Planned]:
        """Return the motion of the next rest, and the way from the posture `q` [rad] to its start."""
        path = rest_motion(self._prepared.assembly, self.rests, self._period_s)
        return path, REST_LEARNING.passage(q, path.at(0)[0], self._period_s)

    def _order(self, machine: LiveFloat, *, is_led: bool, **more: Any) -> int:
        return self._line.send(machine, is_led=is_led, **more)

    def _follow(
        self,
        machine: LiveFloat,
        path: Planned,
        phase: RestPhase,
        progress: RestProgress,
        done_s: float,
        heard: Callable[[int, Joints, Joints], object] = lambda *_: None,
    ) -> float:
        """Move the arm along a path; return the time of the motion that is done then [s]."""
        seconds = self._period_s * len(path)
        number = self._order(machine, is_led=True, path=path)
        self._line.watch(machine, number, path, heard, lambda share: progress(phase, done_s + share * seconds))
        return done_s + seconds

    def _send(self, samples: list[Sample]) -> None:
        self.rests += 1
        if self._process is not None:
            self._is_report_due = True
            self._process.send(samples)

    def _heard(self, machine: LiveFloat) -> RestReport | None:
        """Wait for the result of the rest while the arm is held; None if the process has failed or is too slow."""
        process, until = self._process, time.monotonic() + LEARNS_WITHIN_S
        while process is not None and not process.has_hung_up and time.monotonic() < until:
            for word in process.heard():
                if isinstance(word, RestReport):
                    self._is_report_due, self.so_far = False, word.so_far
                    return word
            machine.wait()
        self._give_up()  # A late result would be taken for that of the next rest.
        return None

    def _give_up(self) -> None:
        self._has_given_up = True
        if self._process is not None:
            self._process.kill()

    def _put_into_force(self, machine: LiveFloat, report: RestReport | None) -> RestLearned | None:
        """Give a better arm to guard and control. Control refuses an arm that fits the cuffs in no posture."""
        if report is None:
            return None
        learned = report.learned
        if learned.verdict is not Verdict.TAKEN:
            self._covariance = report.covariance
            return learned
        machine.wear(self._limits.known(report.x), is_driven=True)
        if self._is_taken(machine, self._order(machine, is_led=True, x=tuple(report.x.tolist()))):
            self._x, self._covariance = report.x, report.covariance
            return learned
        if self._process is not None:
            self._process.send(ArmRefused(self._x, self._covariance))
        return replace(learned, verdict=Verdict.IMPLAUSIBLE, stated_Nm=learned.before_Nm)

    def _is_taken(self, machine: LiveFloat, number: int) -> bool:
        """Wait for control's answer to an order with an arm."""
        seen = 0
        while seen < ANSWERED_ROWS:
            machine.wait()
            rows = self._line.new_rows()
            of_order = rows[rows["order"] == number]
            if (of_order["refused"] == number).any():
                return False
            seen += len(of_order)
        return True
