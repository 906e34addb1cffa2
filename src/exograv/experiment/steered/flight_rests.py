"""Learning in the rests of a steered session: requests of the operator, the thread of a motion, and the panel."""

import contextlib
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from exograv.errors import ExogravError, RigError
from exograv.identification.core.left_over import TARGET_NM
from exograv.live.live_procedure import LiveFloat
from exograv.live.live_processes import Running
from exograv.live.live_rests import LiveRests
from exograv.loop.arm_controller import ArmController
from exograv.loop.replay_log import written_person
from exograv.model.description import RigDescription
from exograv.procedures.identification.rest_learning import REST_MOTION_S
from exograv.procedures.identification.rest_text import RestPhase, phase_text, rest_sentences
from exograv.runtime.control_loop.steering import DescentCommand
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.safety.modes import Mode
from exograv.sentence import Sentence
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import CheckedArm

from .participant_keeping import PRESSED
from .rest_stages import STAGES
from .sentences import say
from .view_models import RestLearning, WorkProgress

WORKS_IN = frozenset({Mode.FLOATING, Mode.MOVING})
"""Modes in which a rest goes on. In any other one the operator, or the guard, has taken the arm's weight away."""

LEVEL_WITHIN_S = GRAVITY_LEVEL_S + 3.0
"""Longest ramp of the gravity level to 0 [s]."""

ANNOUNCED_S = 3.0
"""Shortest announcement on the participant's page before the machine moves the arm [s]."""

ENDS_S = 5.0
"""Time for the thread to end after the run [s]."""

Feel = Callable[[float], str]
"""Function that asks the guard for a gravity level, and returns the reason of a refusal; empty if it is accepted."""

Store = Callable[[CheckedArm], Sentence | None]
"""Function that writes an arm into the participant's file, and returns a sentence about it; None without a file."""


class FlightRests:
    """Rests of one set of processes."""

    def __init__(
        self,
        rests: LiveRests,
        description: RigDescription,
        controller: ArmController,
        feel: Feel,
        level: Callable[[], float],
        store: Store,
    ):
        """Begin without a rest.

        Args:
            rests: Arm of the session.
            description: Description of the machine.
            controller: Controller of this process, which draws the arm.
            feel: Function that asks the guard for a gravity level.
            level: Function that returns the gravity level that the operator or the protocol has asked for [-].
            store: Function that writes an arm into the participant's file.
        """
        self._rests, self._description, self._controller = rests, description, controller
        self._feel, self._level, self._is_level_taken = feel, level, False
        self._store, self._stored = store, rests.checked
        self._running: Running | None = None
        self._is_over, self._thread = threading.Event(), None
        self._targets = tuple(TARGET_NM[place] for place in description.places)
        self._phase, self._done_s, self._seconds = RestPhase.WEIGHT, 0.0, 1.0
        self._sentences: tuple[Sentence, ...] = ()
        self.is_active = False
        """True from the request until the arm floats again, or the motion has ended early."""

    def look(self, running: Running) -> None:
        """Begin to prepare as soon as the arm is learned. Called several times a second by the parent's thread."""
        self._running, worker = running, running.worker
        if worker is None or worker.learned is None or worker.is_refused:
            return
        self._rests.begin(worker.learned)
        if self.is_active:
            return
        self._rests.look()
        if running.control.restarts:
            self._rests.forget()

    def ask(self) -> str:
        """Begin the motion of a rest. Return the reason of a refusal; empty if it begins."""
        if why := self.why_not:
            return why
        self.is_active, self._phase, self._done_s = True, RestPhase.WEIGHT, 0.0
        self._thread = threading.Thread(target=self._run, name="rest", daemon=True)
        self._thread.start()
        return ""

    @property
    def why_not(self) -> str:
        """Reason why no motion can begin; empty if one can."""
        if self.is_active:
            return say("rest.runs")
        worker = None if self._running is None else self._running.worker
        if worker is None or worker.learned is None:
            return say("rest.unlearned")
        if self._rests.has_failed:
            return say("rest.process_ended")
        return "" if self._rests.is_ready else say("rest.prepares")

    def before_take(self, t: float) -> str:
        """Prepare the guard for an arm that floats when it is taken again. Return the reason if it may not be taken.

        A rest that ended early leaves the limits of a driven arm at the guard, and gravity level 0.
        """
        if self.is_active:
            return say("rest.runs")
        if self._rests.has_other_limits and (why := self._wear_known(t)):
            return why
        return self._return_weight()

    def _wear_known(self, t: float) -> str:
        running = self._running
        if running is None:
            return say("guard.absent")
        limits = self._rests.known()
        message = {"person": written_person(limits), "gravity_level": 0.0, "is_driven": False}
        running.recorder.write("/control", t, {"act": "wear", **message})  # for a replay
        try:
            running.line.send(limits)
        except OSError:
            return say("guard.ended")
        self._rests.has_other_limits = False
        return ""

    def view(self) -> RestLearning:
        """Learning in the rests, for the pages."""
        rests = self._rests
        return RestLearning(
            is_active=self.is_active,
            why_not=self.why_not,
            rests=rests.rests,
            left_out=rests.so_far.left_out,
            motion_s=rests.so_far.motion_s,
            before_Nm=_listed(rests.stated_before_Nm),
            stated_Nm=_listed(rests.stated_Nm),
            target_Nm=self._targets,
            stage=STAGES[self._phase] if self.is_active else None,
            moves_s=REST_MOTION_S,
            sentences=self._sentences or (say("rest.help", seconds=f"{REST_MOTION_S:.0f}"),),
        )

    def work(self, v: tuple[float, ...]) -> WorkProgress | None:
        """Progress of the motion; None without one. `v` is the velocity of each joint [rad/s]."""
        if not self.is_active:
            return None
        share = min(self._done_s / self._seconds, 1.0)
        fastest = int(np.abs(v).argmax())
        moves = self._phase in (RestPhase.WAY, RestPhase.MOVES, RestPhase.BACK)
        return WorkProgress(
            kind="rest",
            phase=phase_text(self._phase),
            joint=self._description.joints[fastest] if moves else None,
            share_done=share,
            left_s=None if self._phase is RestPhase.WEIGHT else (1.0 - share) * self._seconds,
            why=say("work.rest"),
        )

    @property
    def so_far(self) -> RestsSoFar:
        """Rests of the session so far."""
        return replace(self._rests.so_far, rests=self._rests.rests)

    def close(self) -> None:
        """End the thread after the run, and the process that learns."""
        self._is_over.set()
        if self._thread is not None:
            self._thread.join(ENDS_S)
        self._rests.close()

    def _run(self) -> None:
        running = self._running
        assert running is not None
        try:
            floating = LiveFloat(running, self._controller, self._is_over, works_in=WORKS_IN)
            with contextlib.closing(floating) as machine:
                self._learn_safely(machine, running)
        except ExogravError as error:
            self._sentences = (say("rest.ended_early", why=str(error)),)
        finally:
            self.is_active = False

    def _learn_safely(self, machine: LiveFloat, running: Running) -> None:
        """Learn in a rest. After any failure during the motion the guard lets the arm down."""
        try:
            machine.wait()
            self._learn(machine)
        except BaseException:
            if self._rests.has_other_limits and machine.mode in WORKS_IN:
                with contextlib.suppress(OSError):
                    running.line.send(DescentCommand(PRESSED))
            raise

    def _learn(self, machine: LiveFloat) -> None:
        """Take the arm's weight, move and learn the arm, and return the weight that the person felt before."""
        begins = say("rest.begins", seconds=f"{REST_MOTION_S:.0f}")
        machine.write("/event", machine.t, {"kind": "rest begins", "text": str(begins)})
        announced_until = machine.t + ANNOUNCED_S
        if machine.gravity_level > 0.0 or self._level() > 0.0:
            self._take_weight(machine)
        machine.float_for(announced_until - machine.t, lambda _t, _q: False)
        self._seconds = self._rests.motion_s(machine.q)
        learned = self._rests.perform(machine, self._progress)
        if learned is None:
            self._sentences = (say("rest.process_ended"),)
        else:
            self._sentences = (*rest_sentences(learned, self._description), *self._kept())
        text = " ".join(self._sentences)
        machine.write("/event", machine.t, {"kind": "rest learning", "text": text})
        self._return_weight()

    def _kept(self) -> tuple[Sentence, ...]:
        """Store a new estimate; return the sentence about it.

        The arm floats: a rest that was stopped before, even with its arm in force, is not stored.
        """
        checked = self._rests.checked
        if checked is None or checked == self._stored:
            return ()
        self._stored = checked
        told = self._store(checked)
        return () if told is None else (told,)

    def _take_weight(self, machine: LiveFloat) -> None:
        """Lead the felt gravity level to 0: only an arm whose whole weight is carried is relaxed.

        Raises:
            RigError: The guard refused it, or it took too long.
        """
        if why := self._feel(0.0):
            raise RigError(why)
        self._is_level_taken = True
        machine.float_for(LEVEL_WITHIN_S, lambda _t, _q: machine.gravity_level == 0.0)
        if machine.gravity_level > 0.0:
            raise RigError(say("rest.not_taken"))

    def _return_weight(self) -> str:
        """Ask for the felt level from before the rest. Return the reason of a refusal."""
        if not self._is_level_taken:
            return ""
        why = self._feel(self._level())
        self._is_level_taken = bool(why)
        return why

    def _progress(self, phase: RestPhase, done_s: float) -> None:
        self._phase, self._done_s = phase, done_s


def _listed(values: np.ndarray | None) -> tuple[float, ...]:
    return () if values is None else tuple(values.tolist())
