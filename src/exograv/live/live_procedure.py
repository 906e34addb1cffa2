"""Procedure in the session's process while the arm floats in a live run: the same code as in lock-step.

The procedure runs in a thread. It reads the messages of the guard to control, and sends requests to the guard, which
decides on them. However it ends, the guard lets the arm down.
"""

import contextlib
import math
import threading
import time
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

import numpy as np

from exograv.errors import RigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.floating_machine import LOOK_S, Look
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import written_person
from exograv.model.arm import is_plausible
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.identify import IMPLAUSIBLE
from exograv.runtime.control_loop.exchange import FeltLevel, PersonUpdate, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.safety.guard import SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.modes import Mode
from exograv.signals import Reference

from .arm_worker import LearnedArm
from .live_control import MODES
from .live_processes import HANGS_S, Running

POLL_S = 0.002
"""Time between two looks for a new state of the guard [s]."""

ENDS_S = 5.0
"""Time for the thread to end after the run [s]."""

STOPPED = "The machine was stopped before the procedure was complete."
OVER = "The run ended before the procedure was complete."
GIVEN_BACK = "The arm was given back before the procedure was complete."
LATE = "The time of the run was over before the procedure was complete."

Joints = np.ndarray


class LiveFloat:
    """`FloatingMachine` of a live run, by the guard's messages to control."""

    def __init__(
        self,
        running: Running,
        controller: ArmController,
        is_over: threading.Event,
        longest_s: float = math.inf,
        works_in: Collection[Mode] = MODES,
    ):
        """Open the memory of the guard's messages.

        Args:
            running: Processes of the run.
            controller: Controller of this process, which draws the arm and commands nothing.
            is_over: Event that ends each wait, because the run is over.
            longest_s: Time of the machine's clock from its first state on, after which a wait fails [s].
            works_in: Modes in which a wait goes on; it fails in another mode.
        """
        joints = running.recorder.inlet.n_joints
        self._running, self._controller, self._is_over = running, controller, is_over
        self._longest_s, self._begun_at, self._works_in = longest_s, math.nan, works_in
        # Mailboxes of this thread: the session closes its own ones at the end of the run.
        self._states = Mailbox(state_dtype(joints), running.states.name)
        self._answers = Mailbox(answer_dtype(joints), running.answers.name)
        self._still, self._count, self._state = np.zeros(joints), 0, np.zeros((), state_dtype(joints))

    def close(self) -> None:
        """Close the mailboxes of states and answers."""
        self._states.close()
        self._answers.close()

    @property
    def t(self) -> float:
        """Time of the newest state on the machine's clock [s]."""
        return float(self._state["now"])

    @property
    def q(self) -> Joints:
        """Joint position in the newest state [rad]."""
        return self._state["q"].copy()

    @property
    def gravity_level(self) -> float:
        """Share of the arm's weight that the person feels now, by the guard [-]."""
        return float(self._state["gravity_level"])

    @property
    def v(self) -> Joints:
        """Joint velocity that control has observed, in its newest answer [rad/s]; zero before the first answer."""
        answer = self._answers.read()
        return self._still.copy() if answer is None else answer[1]["v"].copy()

    @property
    def drive(self) -> float:
        """Share of the feedback in control's newest answer [-]."""
        answer = self._answers.read()
        return 0.0 if answer is None else float(answer[1]["drive"])

    @property
    def mode(self) -> Mode | None:
        """Mode in control's newest answer; None before the first answer."""
        answer = self._answers.read()
        return None if answer is None else MODES[int(answer[1]["mode"])]

    @property
    def learned(self) -> LearnedArm:
        """Arm that the worker has learned. There is one as soon as the arm floats."""
        worker = self._running.worker
        assert worker is not None
        assert worker.learned is not None
        return worker.learned

    def begin(self, phase: str) -> None:
        """Note in the recording the part of the procedure that begins. The phases of a live run are its modes."""
        self.write("/event", self.t, {"kind": "note", "text": f"Procedure: {phase}."})

    def feel(self, gravity_level: float) -> None:
        """Ask the guard to lead the felt gravity level to this value. A stopped guard refuses it.

        Raises:
            RigError: The run is over.
        """
        self.write("/control", self.t, {"act": "level", "gravity_level": gravity_level})  # for a replay
        self._send(FeltLevel(gravity_level))

    def wear(self, person: PersonLimits, is_driven: bool) -> None:
        """Give the guard other limits of the person, and wait until they are in force.

        Args:
            person: Limits of the person.
            is_driven: True if control holds or moves the arm from now on.

        Raises:
            RigError: The machine was stopped, or the run is over.
        """
        message = {"person": written_person(person), "gravity_level": self.gravity_level, "is_driven": is_driven}
        self.write("/control", self.t, {"act": "wear", **message})  # for a replay
        before = int(self._state["persons"])
        self._send(PersonUpdate(person) if is_driven else person)
        while int(self._state["persons"]) == before:
            self.wait()

    def float_for(self, seconds: float, look: Look) -> None:
        """Let the arm float for a time of the machine's clock [s], or until `look` returns True.

        Raises:
            RigError: The machine was stopped, or the run is over.
        """
        until, looked = self.t + seconds, self.t
        while self.t < until:
            self.wait()
            if self.t - looked >= LOOK_S:
                looked = self.t
                if look(self.t, self.q):
                    return

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points of the exoskeleton and of the arm in the base frame [m], by the controller's model."""
        self._controller.step(q, self._still, Reference(q, self._still, self._still))
        return self._controller.skeleton(q)

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Have a message of the time `t` [s] recorded."""
        self._running.recorder.write(topic, t, message)

    def _send(self, message: object) -> None:
        try:
            self._running.line.send(message)
        except OSError as error:
            raise RigError(OVER) from error

    def wait(self) -> None:
        """Wait for the next state of the guard.

        Raises:
            RigError: The machine was stopped or gave the arm back, or the run or its time is over.
        """
        until = time.monotonic() + HANGS_S
        while True:
            got = self._states.read()
            if got is not None and got[0] != self._count:
                self._count, self._state = got
                if int(self._state["safe_state"]) >= SafeState.DESCENT:
                    raise RigError(STOPPED)
                self._begun_at = self.t if math.isnan(self._begun_at) else self._begun_at
                if self.t - self._begun_at > self._longest_s:
                    raise RigError(LATE)
                if (mode := self.mode) is not None and mode not in self._works_in:
                    raise RigError(GIVEN_BACK)
                return
            if self._is_over.is_set() or time.monotonic() > until:
                raise RigError(OVER)
            time.sleep(POLL_S)

    def is_floating(self) -> bool:
        """Return True if the arm is learned, and floats behind a guard that has the person's limits."""
        worker, answer = self._running.worker, self._answers.read()
        is_learned = worker is not None and worker.learned is not None and int(self._state["persons"]) > 0
        if not is_learned or answer is None:
            return False
        return self.mode is Mode.FLOATING and float(answer[1]["drive"]) == 0.0


Performed = Callable[[LiveFloat, Progress], object]
"""Procedure on a machine in which the arm floats. It raises `ExogravError` if it cannot go on."""


class LiveProcedure:
    """Thread that performs a procedure as soon as the arm floats, and then ends the run."""

    def __init__(
        self,
        performs: Performed,
        prepared: ControllerKnowledge,
        period_s: float,
        progress: Progress,
        longest_s: float = math.inf,
    ):
        """Prepare the model of the arm. This takes seconds.

        Args:
            performs: Procedure.
            prepared: Machine with the arm in it, as known before the run.
            period_s: Period of the machine [s].
            progress: Function that shows the progress of run and procedure.
            longest_s: Time of the run after which an unfinished procedure ends, and the arm is let down [s]. The loop
                of the guard must be longer than that: at its end the guard lets the arm down without a reason.
        """
        self._longest_s = longest_s
        self._performs, self._prepared, self._shown = performs, prepared, progress
        self._controller = ArmController(prepared.assembly, prepared.machine, prepared.x, period_s)
        self._is_over, self._thread = threading.Event(), None
        self.has_begun = False
        """True if the arm floated and the procedure began."""
        self.failure: BaseException | None = None
        """Error that ended the procedure early."""

    def begin(self, running: Running) -> None:
        """Begin to wait for the floating arm."""
        self._thread = threading.Thread(target=partial(self._run, running), name="procedure", daemon=True)
        self._thread.start()

    def __enter__(self) -> "LiveProcedure":
        return self

    def __exit__(self, *_: object) -> None:
        """End the thread after the run."""
        self._is_over.set()
        if self._thread is not None:
            self._thread.join(ENDS_S)
            if self._thread.is_alive() and self.failure is None:
                self.failure = RigError(OVER)

    def _run(self, running: Running) -> None:
        try:
            with contextlib.closing(LiveFloat(running, self._controller, self._is_over, self._longest_s)) as machine:
                self._await_float(running, machine)
                self.has_begun = True
                self._performs(machine, self._shown)
        except BaseException as error:  # noqa: BLE001 - raised again by `fly_on_drives` when the arm is down
            self.failure = error
        finally:
            with contextlib.suppress(OSError):
                running.stop()

    def _await_float(self, running: Running, machine: LiveFloat) -> None:
        while not machine.is_floating():
            machine.wait()
        x = machine.learned.carried.x
        # Control and guard keep the table's arm in place of an implausible one, and nobody may be tested with it.
        if not is_plausible(self._prepared.assembly.arm, x):
            raise RigError(f"{IMPLAUSIBLE} The procedure did not begin.")
        self._controller.put_in_force(x)
        machine.skeleton(machine.q)
