"""What the two processes of `exograv live` are made of: the twin behind its guard, and control with its mode."""

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import OutputFeedback
from exograv.loop.phases import FLOATING, IDENTIFICATION, next_drive
from exograv.model.description import RigDescription
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig import Rig
from exograv.runtime.clock.timing import PERIOD_NS
from exograv.runtime.control_loop.steering import ASKABLE
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard, SafeState
from exograv.safety.modes import REST_BEFORE_RAMP_S, WORN, Event, Mode, ModeMachine
from exograv.safety.person import GuardedPerson, PersonLimits
from exograv.signals import Reference
from exograv.storage.self_test_pass import MachineKey, unlock

from .guard_process import GuardedRig
from .live_identification import LiveIdentification, LiveIdentificationPlan

SKIPPED = "skipped: twin"
SKIPPED_TEXT = "The self-test is skipped: this is the twin, and nobody is in it."

OPERATOR: Mapping[Mode, Event] = MappingProxyType(
    {Mode.SAFE: Event.RESET, Mode.OFF: Event.TEST, Mode.SELF_TEST: Event.PASSED}
)
"""What the virtual operator does as soon as it is possible, one event a tick. `PASSED` follows at once: on the twin the
self-test is done before the loop, or skipped, and the recording says so."""

MODES = tuple(Mode)


def notes(is_tested: bool) -> dict[str, str]:
    """What to record when a mode begins."""
    return {} if is_tested else {Mode.SELF_TEST.name.lower(): SKIPPED_TEXT}


@runtime_checkable
class PhaseListener(Protocol):
    """A machine in which somebody hears what it begins."""

    def hear(self, mode_name: str) -> None:
        """A mode has begun, by its name in lower case."""
        ...


@dataclass(frozen=True)
class LivePlan:
    """What each process builds its part from."""

    description: RigDescription
    told: WearerForm
    prepared: ControllerKnowledge
    person: PersonLimits
    gravity_level: float
    machine: Callable[[], Rig]
    """Makes the machine, in the process that owns it."""

    period_ns: int = PERIOD_NS
    """Of the machine [ns]."""

    lesson: LiveIdentificationPlan | None = None
    """How the arm is learned live; absent where it is known."""

    key: MachineKey | None = None
    """What unlocks a real machine."""

    is_steered: bool = False
    """Whether somebody at a page asks for each step."""


def guarded_rig(plan: LivePlan) -> GuardedRig:
    """The machine, and the guard in front of it.

    Raises:
        RigError: The machine is locked.
    """
    rig, gain = plan.machine(), plan.prepared.machine.actuators
    unlock(rig, plan.key)
    envelope = Envelope(limits(plan.description), rig.period_s)
    envelope.person = GuardedPerson(plan.person, plan.gravity_level)
    envelope.person.drive(plan.lesson is not None)
    guard = Guard.of_machine(envelope, rig.period_s, gain.gain.tolist())
    announce = rig.hear if isinstance(rig, PhaseListener) else lambda _mode: None
    return GuardedRig(rig, guard, gain.gain, announce)


class LiveControl:
    """`Answering`: the arm's controller, and the mode that says how much of the arm is carried."""

    mode_names = tuple(mode.name.lower() for mode in MODES)

    def __init__(
        self,
        prepared: ControllerKnowledge,
        gravity_level: float,
        is_first: bool = True,
        lesson: LiveIdentification | LiveIdentificationPlan | None = None,
        period_s: float = 1e-9 * PERIOD_NS,
        is_steered: bool = False,
    ):
        """The machine is off; a control that comes later finds it in a safe state."""
        self._is_steered, self._obeyed = is_steered, 0 if is_first else None
        self._controller = ArmController(prepared.assembly, prepared.machine, prepared.x, period_s)
        self._controller.mode.gravity_level = gravity_level
        self._still, self._period_s = np.zeros(prepared.assembly.n), period_s
        self._modes = ModeMachine() if is_first else ModeMachine(Mode.SAFE)
        self._rested_s, self._has_begun = 0.0, not is_first
        self._lesson = lesson.lesson() if isinstance(lesson, LiveIdentificationPlan) else lesson
        self._actuators = prepared.machine.actuators
        self._q_ramp = self._still
        # The first step finds the loops' posture from cold, which takes longer than a tick.
        posture = prepared.assembly.description.donning_posture
        self._controller.step(posture, self._still, self._hold(self._still))
        self._controller = self._controller.again(prepared.x)
        self._controller.mode.gravity_level = gravity_level
        self._feedback = OutputFeedback(prepared.assembly.n, period_s, self._controller)
        self._feedback.guide = self._guide

    @property
    def mode(self) -> Mode:
        """In force."""
        return self._modes.mode

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """One tick."""
        self._state, feedback = state, self._feedback
        tau = feedback.step(state["q"])
        reference = feedback.reference
        row["tau"] = tau if self.mode is Mode.EXO_ONLY or self.mode in WORN else self._still
        row["tau_feedforward"], row["v"] = self._controller.tau_feedforward, feedback.v
        row["q_reference"] = reference.q if self._controller.mode.drive else np.nan
        row["slope"], row["mode"] = self._controller.closure_slope, MODES.index(self.mode)
        row["findings"] = 0 if self._lesson is None else self._lesson.findings
        row["drive"], row["gravity_level"], row["arm_share"] = astuple(self._controller.mode)
        if self._lesson is not None and self.mode is Mode.MOVING:
            self._lesson.told(float(state["now"]), state["q"], self._actuators.torque(state["current"]), reference.q)

    def forget(self, mode: Mode, arm_share: float) -> None:
        """Begin anew in this mode with this share of the arm: after a time that nobody saw."""
        self._feedback.forget()
        self._modes, self._rested_s, self._has_begun = ModeMachine(mode, arm_share), 0.0, True
        self._controller.forget()

    def _guide(self, q: np.ndarray, v: np.ndarray) -> Reference:
        """Bring the mode up to date, then say what to follow in it."""
        state = self._state
        now = float(state["now"])
        self._follow(state, q, v)
        self._learn(now, int(state["persons"]), q)
        reference = self._reference(now, q)
        self._controller.mode.arm_share = self._modes.arm_share
        self._controller.mode.gravity_level = float(state["gravity_level"])
        return reference

    def _hold(self, q: np.ndarray) -> Reference:
        return Reference(q, self._still, self._still)

    def _reference(self, now: float, q: np.ndarray) -> Reference:
        if not self._controller.mode.drive or self._lesson is None:
            return self._hold(q)
        return self._hold(self._q_ramp) if self.mode is Mode.RAMP_IN else self._lesson.reference(now)

    def _follow(self, state: np.void, q: np.ndarray, v: np.ndarray) -> None:
        """What the guard says decides; the arm is taken by a ramp, at first and after each reset."""
        modes, event = self._modes, self._asked(state)
        if int(state["safe_state"]) >= SafeState.DESCENT:
            if modes.take(Event.FAULT):
                # Its posture may be what went wrong, and would be carried on past every reset.
                self._controller.forget()
            self._rested_s = 0.0
            return
        if not self._has_begun:
            self._has_begun = True  # a tick switched off, for the recording to begin with
        elif event is not None and modes.take(event) and event is Event.TAKE_ARM:
            self._rested_s, self._q_ramp = 0.0, q.copy()
            if self._lesson is not None:
                self._lesson.prepare(self._q_ramp)
        modes.step(self._period_s, float(np.abs(q - self._q_ramp).max()), float(np.abs(v).max()))

    def _asked(self, state: np.void) -> Event | None:
        """What an operator wants now: at a page, as the guard passes it on once; or the virtual one."""
        if self._is_steered:
            before, self._obeyed = self._obeyed, int(state["asked"])
            return None if before is None or before == self._obeyed else ASKABLE[int(state["event"])]
        if self._modes.mode is not Mode.EXO_ONLY:
            return OPERATOR.get(self._modes.mode)
        if int(state["safe_state"]) < SafeState.DESCENT:
            self._rested_s += self._period_s
        return Event.TAKE_ARM if self._rested_s >= REST_BEFORE_RAMP_S else None

    def _learn(self, now: float, persons: int, q: np.ndarray) -> None:
        """An arm that is not known yet is moved as soon as it is taken, and let go when the guard knows it."""
        lesson, modes = self._lesson, self._modes
        if lesson is None:
            return
        if (x := lesson.found()) is not None:
            self._controller.publish(x, q)
        phase = lesson.phase(persons)
        if modes.mode is Mode.FLOATING and phase is IDENTIFICATION:
            modes.take(Event.MOVE)
            lesson.begin(now)
        elif modes.mode is Mode.MOVING and phase is FLOATING:
            modes.take(Event.FLOAT)
        elif modes.mode is Mode.MOVING:
            lesson.enter(phase, now)
        mode = self._controller.mode
        mode.drive = next_drive(mode.drive, modes.mode, bool(persons), self._period_s)
