"""Parts of the two processes of `exograv run live`: the machine with its guard, and control with its mode machine."""

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.identification.core.arm_model import ArmModel
from exograv.loop.arm_controller import ArmController
from exograv.loop.drift_finding import CAUSES
from exograv.loop.drift_monitor import DriftMonitor
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import OutputFeedback
from exograv.loop.phases import FLOATING, IDENTIFICATION, next_drive
from exograv.model.description import ArmSide, RigDescription
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig import Rig
from exograv.runtime.clock.timing import PERIOD_NS
from exograv.runtime.control_loop.exchange import answer_dtype
from exograv.runtime.control_loop.steering import ASKABLE
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard, SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.modes import REST_BEFORE_RAMP_S, WORN, Event, Mode, ModeMachine
from exograv.safety.person import GuardedPerson
from exograv.signals import Reference
from exograv.storage.self_test_pass import MachineKey, unlock

from .guard_job import GuardedRig
from .live_identification import LiveIdentification, LiveIdentificationPlan
from .procedure_orders import Order, OrderedMotion, OrderMemory, TaughtRows

SKIPPED = "skipped: twin"
SKIPPED_TEXT = "The self-test is skipped: this is the twin, and nobody is in it."

OPERATOR: Mapping[Mode, Event] = MappingProxyType(
    {Mode.SAFE: Event.RESET, Mode.OFF: Event.TEST, Mode.SELF_TEST: Event.PASSED}
)
"""Events of the virtual operator by mode, one event per tick, as soon as possible.

`PASSED` follows at once: on the twin the self-test runs before the loop, or it is skipped and the recording says so.
"""

MODES = tuple(Mode)

REHEARSALS = 50
"""Answers that are computed and discarded before the first tick."""


def notes(is_tested: bool) -> dict[str, str]:
    """Return notes to record when a mode begins, by the name of the mode."""
    return {} if is_tested else {Mode.SELF_TEST.name.lower(): SKIPPED_TEXT}


@runtime_checkable
class PhaseListener(Protocol):
    """Machine that announces each mode to its wearer when the mode begins."""

    def hear(self, mode_name: str) -> None:
        """Announce a mode that begins, by its name in lower case."""
        ...


@dataclass(frozen=True)
class LivePlan:
    """Plan of a live run, from which each process builds its part."""

    description: RigDescription
    told: WearerForm
    prepared: ControllerKnowledge
    person: PersonLimits
    gravity_level: float
    machine: Callable[[], Rig]
    """Function that builds the machine, called in the process that owns it."""

    period_ns: int = PERIOD_NS
    """Period of the machine [ns]."""

    lesson: LiveIdentificationPlan | None = None
    """Plan of the live identification; None if the arm is known."""

    key: MachineKey | None = None
    """Serial number and self-test that unlock a real machine; None for the twin."""

    is_steered: bool = False
    """True if an operator at a page requests each step."""

    orders: OrderMemory | None = None
    """Memory of the orders of a procedure that moves the identified arm; None without such a procedure."""

    @property
    def taught(self) -> TaughtRows | None:
        """Taught path of the procedure; None without one."""
        return None if self.orders is None else self.orders.taught

    @property
    def leading(self) -> ArmSide | None:
        """Arm that leads the other one in the procedure; None without one."""
        return None if self.orders is None else self.orders.leading


def guarded_rig(plan: LivePlan) -> GuardedRig:
    """Build the machine and its guard.

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
    """Controller of the arm with its mode machine, which sets the share of the arm that is carried."""

    mode_names = tuple(mode.name.lower() for mode in MODES)

    def __init__(
        self,
        prepared: ControllerKnowledge,
        gravity_level: float,
        is_first: bool = True,
        lesson: LiveIdentification | LiveIdentificationPlan | None = None,
        period_s: float = 1e-9 * PERIOD_NS,
        is_steered: bool = False,
        publishes_later: bool = True,
        orders: OrderedMotion | OrderMemory | None = None,
    ):
        """Begin with the machine off; a replacement (`is_first` False) begins with the machine in a safe state.

        With `publishes_later`, a new estimate of the arm comes into force in `afterwards`; otherwise in the answer.
        """
        self._publishes_later, self._found = publishes_later, None
        self._later: list[Order] = []
        self._ordered = orders.motion(prepared.assembly, period_s) if isinstance(orders, OrderMemory) else orders
        self._is_steered, self._is_first, self._gravity_level = is_steered, is_first, gravity_level
        self._controller = ArmController(prepared.assembly, prepared.machine, prepared.x, period_s)
        self._model, self._covariance = ArmModel(prepared.assembly, prepared.machine), prepared.covariance
        self._still, self._period_s = np.zeros(prepared.assembly.n), period_s
        self._lesson = lesson.lesson() if isinstance(lesson, LiveIdentificationPlan) else lesson
        self._actuators = prepared.machine.actuators
        self._begin()

    def prepare(self, state: np.void) -> None:
        """Prepare for the posture in `state`, which stands before the first tick.

        The first answers run code and memory that are cold, and the first step at a posture solves the closure without
        a warm start. Both take longer than a tick. The first eigenvalues of a full matrix, in `publish`, take even
        17 ms: the linear algebra library then reserves 32 MB, and locked memory is filled at once.
        """
        if not np.isfinite(state["q"]).all():
            return
        row = np.zeros((), answer_dtype(len(self._still)))
        for _ in range(REHEARSALS):
            self.answer(state, row)
            self.afterwards()
        self._controller.publish(self._controller.x.copy(), state["q"].copy())
        self._drift.rehearse(state["q"])
        np.linalg.eigvalsh(np.eye(4) + 0.1)
        if self._lesson is not None:
            self._lesson.prepare(state["q"].copy())
        self._begin()
        self._controller.step(state["q"], self._still, self._hold(state["q"]))

    def _begin(self) -> None:
        """Set the state before the first answer."""
        self._modes = ModeMachine() if self._is_first else ModeMachine(Mode.SAFE)
        self._rested_s, self._has_begun = 0.0, not self._is_first
        self._obeyed, self._q_ramp = 0 if self._is_first else None, self._still
        self._controller = self._controller.again(self._controller.x)
        self._leading: ArmSide | None = None
        if self._ordered is not None:
            self._ordered.skeleton = self._controller.skeleton
        self._controller.mode.gravity_level = self._gravity_level
        self._controller.mode.arm_share = self._modes.arm_share
        self._drift = DriftMonitor(self._controller, self._covariance, self._period_s, self._model, in_parts=True)
        self._feedback = OutputFeedback(len(self._still), self._period_s, self._controller)
        self._feedback.guide = self._guide

    @property
    def mode(self) -> Mode:
        """Present mode of the mode machine."""
        return self._modes.mode

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """Compute the answer to one tick of the guard."""
        self._state, feedback = state, self._feedback
        self._take_orders()
        tau = feedback.step(state["q"])
        reference = feedback.reference
        row["tau"] = tau if self.mode is Mode.EXO_ONLY or self.mode in WORN else self._still
        row["tau_feedforward"], row["v"] = self._controller.tau_feedforward, feedback.v
        row["q_reference"] = reference.q if self._controller.mode.drive else np.nan
        row["slope"], row["mode"] = self._controller.closure_slope, MODES.index(self.mode)
        row["findings"] = self._inputs
        drift = self._drift.finding
        row["drift"] = 0 if drift is None else drift.level
        if drift is not None:
            row["drift_joint"], row["drift_Nm"] = drift.joint, drift.residual_Nm
            row["drift_cause"] = CAUSES.index(drift.cause)
        row["drive"], row["gravity_level"], row["arm_share"] = astuple(self._controller.mode)
        if self.mode is Mode.MOVING:
            self._tell(float(state["now"]), reference.q)

    def afterwards(self) -> None:
        """Put a new estimate, an ordered arm and ordered weights into force, with a ramp, and look for drift.

        Both take longer than a tick has left before its answer.
        """
        self._publish_found()
        for order in self._later:
            self._put_into_force(order)
        self._later.clear()
        if self._ordered is None or self._ordered.is_load_known:
            self._drift.take(self._state["q"], self._actuators.torque(self._state["current"]))

    def _put_into_force(self, order: Order) -> None:
        if order.mass_kg is not None:
            self._controller.carry(order.place, order.mass_kg, self._feedback.q)
        is_taken = order.x is None or self._controller.publish(np.array(order.x), self._feedback.q)
        if self._ordered is not None and not is_taken:
            self._ordered.refuse(order)

    def _publish_found(self) -> None:
        if self._found is not None:
            self._controller.publish(self._found, self._feedback.q)
            self._found = None

    @property
    def _inputs(self) -> int:
        """Number of findings of the worker and of orders of a procedure that control has taken."""
        findings = 0 if self._lesson is None else self._lesson.findings
        return findings if self._ordered is None else findings + self._ordered.count

    def _tell(self, now: float, q_asked: np.ndarray) -> None:
        """Send this tick of a motion to the procedure that has ordered it, or to the worker."""
        q, tau = self._state["q"], self._actuators.torque(self._state["current"])
        if self._ordered is not None and self._ordered.is_led:
            self._ordered.told(now, q, tau)
        elif self._lesson is not None:
            self._lesson.told(now, q, tau, q_asked)

    def _take_orders(self) -> None:
        """Take the orders of a procedure while the identified arm floats or is moved."""
        ordered = self._ordered
        if ordered is None or self.mode not in (Mode.FLOATING, Mode.MOVING):
            return
        was_known = ordered.is_load_known
        while (order := ordered.take(self._state["q"])) is not None:
            if order.mass_kg is not None or order.x is not None:
                self._later.append(order)
        if ordered.is_load_known is not was_known:
            self._drift.restart()

    def forget(self, mode: Mode, arm_share: float) -> None:
        """Restart in a mode with a share of the arm, after a gap in the recording."""
        self._feedback.forget()
        self._drift.restart()
        self._modes, self._rested_s, self._has_begun = ModeMachine(mode, arm_share), 0.0, True
        self._controller.forget()

    def _guide(self, q: np.ndarray, v: np.ndarray) -> Reference:
        """Update the mode, then return its reference."""
        state = self._state
        now = float(state["now"])
        self._follow(state, q, v)
        self._learn(now, int(state["persons"]))
        reference = self._reference(now, q, v)
        self._controller.mode.arm_share = self._modes.arm_share
        self._controller.mode.gravity_level = float(state["gravity_level"])
        return reference

    def _hold(self, q: np.ndarray) -> Reference:
        return Reference(q, self._still, self._still)

    def _reference(self, now: float, q: np.ndarray, v: np.ndarray) -> Reference:
        if not self._controller.mode.drive:
            return self._hold(q)
        if self._ordered is not None and self._ordered.order is not None:
            return self._ordered.reference(now, self._controller.mode.drive, q, v)
        if self._lesson is None:
            return self._hold(q)
        return self._hold(self._q_ramp) if self.mode is Mode.RAMP_IN else self._lesson.reference(now)

    def _follow(self, state: np.void, q: np.ndarray, v: np.ndarray) -> None:
        """Update the mode from the guard's safe state. A ramp takes the arm's weight, at first and after each reset."""
        modes, event = self._modes, self._asked(state)
        if int(state["safe_state"]) >= SafeState.DESCENT:
            if modes.take(Event.FAULT):
                # The solved posture may be the cause of the fault; without this it would survive every reset.
                self._controller.forget()
                self._drift.restart()
                if self._ordered is not None:
                    self._ordered.drop()
            self._rested_s = 0.0
            return
        if not self._has_begun:
            self._has_begun = True  # The recording begins with one tick in mode `OFF`.
        elif event is not None and modes.take(event) and event is Event.TAKE_ARM:
            self._rested_s, self._q_ramp = 0.0, q.copy()
            if self._ordered is not None:
                self._ordered.discard()
            if self._lesson is not None:
                self._lesson.prepare(self._q_ramp)
        modes.step(self._period_s, float(np.abs(q - self._q_ramp).max()), float(np.abs(v).max()))

    def _asked(self, state: np.void) -> Event | None:
        """Return the event that the operator requests now.

        The guard passes on each request of an operator at a page once. Without a page a virtual operator decides.
        """
        if self._is_steered:
            before, self._obeyed = self._obeyed, int(state["asked"])
            return None if before is None or before == self._obeyed else ASKABLE[int(state["event"])]
        if self._modes.mode is not Mode.EXO_ONLY:
            return OPERATOR.get(self._modes.mode)
        if int(state["safe_state"]) < SafeState.DESCENT:
            self._rested_s += self._period_s
        return Event.TAKE_ARM if self._rested_s >= REST_BEFORE_RAMP_S else None

    def _learn(self, now: float, persons: int) -> None:
        """Move an unknown arm as soon as the machine carries it; let it float when the guard knows its limits."""
        lesson, modes = self._lesson, self._modes
        if lesson is None:
            return
        if (x := lesson.found()) is not None:
            self._found = x
            if not self._publishes_later:
                self._publish_found()
        phase = lesson.phase(persons)
        is_led = self._ordered is not None and self._ordered.is_led
        if modes.mode is Mode.FLOATING and phase is IDENTIFICATION:
            modes.take(Event.MOVE)
            lesson.begin(now)
        elif is_led:
            modes.take(Event.MOVE)
        elif modes.mode is Mode.MOVING and phase is FLOATING:
            modes.take(Event.FLOAT)
        elif modes.mode is Mode.MOVING:
            lesson.enter(phase, now)
        self._let_lead()
        mode = self._controller.mode
        mode.drive = next_drive(mode.drive, modes.mode, bool(persons), self._period_s)

    def _let_lead(self) -> None:
        """Let one arm lead the other, or none. The controller allows the change only while nothing is driven."""
        leading = None if self._ordered is None else self._ordered.leading
        if leading != self._leading and not self._controller.mode.drive:
            self._controller.let_lead(leading)
            self._leading = leading
