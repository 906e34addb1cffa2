"""Live run on drives (`exograv run live --drives`): the machine learns the wearer's arm live, then the arm floats."""

import contextlib
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError, IdentificationError, RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.live.guard_job import LONGEST_DESCENT_S
from exograv.live.live_control import LivePlan
from exograv.live.live_figures import LiveFigures, live_figures
from exograv.live.live_flight import fly_plan, lesson_plan, streaming_of
from exograv.live.live_identification import lesson_passes, person_believed, unknown_person
from exograv.live.live_moved import LiveMoved
from exograv.live.live_procedure import LiveFloat, LiveProcedure
from exograv.live.live_processes import LiveResult, Running
from exograv.live.options import LiveOptions, PersonForm, ReturningPerson
from exograv.live.procedure_orders import OrderMemory, TaughtRows
from exograv.loop.floating_machine import FloatingMachine
from exograv.loop.keyboard import is_line_typed
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.loop.pilot import Progress
from exograv.model.anthropometry import Body
from exograv.model.description import ArmSide, load_rig
from exograv.model.support import assemble
from exograv.model.wearer_form import WearerForm
from exograv.next_command import same_machine
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.identification.controller_knowledge import MOTION_S, ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.options import NO_FILES, ParticipantOptions
from exograv.procedures.identification.participant_session import ParticipantRun, motion_needed_s
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.verification.postures import Verification, unseen_postures
from exograv.recording.disk import refuse_small_disk
from exograv.rig.drives.opening import open_drives
from exograv.rig.drives.settings import Drives
from exograv.runtime.lsl.listening import Listening
from exograv.safety.stops import StopReason
from exograv.storage.participant_file import AGAIN, read_participant
from exograv.storage.participant_schema import StoredParticipant

from .arm_files import keep_flown, stored_arm
from .connection import CONNECTING, Say, drawn_by, drives_with_hands, not_ready, readiness_of
from .fault_lock import lock_after_fault
from .wearer_form import form_of_wearer

SEEN_EVERY_S = 0.05
"""Sampling period of the identification motion, to find postures that the motion has not visited [s]."""

BUSY_S = 60.0
"""Time by which a busy computer may delay a procedure [s]: simulated drives move on while the worker computes."""

READY = (
    "Check that the arm lies in its cuffs, supported and relaxed. Then press Enter: the motors switch on, carry the "
    "machine for a second, then take the arm. Ctrl-C lowers the arm softly at any time."
)


@dataclass(frozen=True)
class FlownOnDrives:
    """Result of a live run on drives, with the knowledge of the controller."""

    flown: LiveResult
    figures: LiveFigures
    prepared: ControllerKnowledge
    wearer: SimulatedWearer | None
    """Simulated wearer; None if machine and person are real."""
    verification: Verification | None
    """Verification that followed the identification; None without one."""
    body: Body
    """Body data of the wearer."""
    serial: str
    """Serial number of the machine."""
    from_file: bool
    """True if the identification started from a participant's file."""


@dataclass(frozen=True)
class Procedure:
    """Command that flies on drives, with its steps around the identification."""

    command: str = "run live"
    is_verified: bool = False
    """True if a verification follows the identification."""
    files: ParticipantOptions = NO_FILES
    """Files of the person's arm: the identification starts from one and writes one."""
    form: WearerForm | None = None
    """Form of a dummy arm in the place of a person."""
    simulation: tuple[str, ...] = ("--worn",)
    """Options of `exograv dev drive-sim`."""
    recording_in: Path | None = None
    """Folder of the recording, by default that of the machine's files."""
    recording_name: str = "live.mcap"
    """Name of the recording."""
    ready: str = READY
    """Instruction to the operator before the motors switch on."""
    acts: Callable[[Running, Hands], object] = lambda *_: None
    """Function that is called several times a second while the loop runs."""
    afterwards: Callable[[Drives, Hands], object] = lambda *_: None
    """Function that is called after the flight, while simulated drives still exist and the bus is free."""
    performs: Callable[[FloatingMachine, Hands, Progress], object] | None = None
    """Procedure with the floating arm, after which the arm is let down; None to let it float for the given time."""
    moves: Callable[[LiveMoved, Hands, Progress], object] | None = None
    """Procedure that moves the identified arm, in the place of `performs`."""
    taught: TaughtRows | None = None
    """Taught path for a procedure that moves the arm."""
    leading: ArmSide | None = None
    """Leading arm for a procedure in which one arm leads the other."""
    on_purpose: tuple[StopReason, ...] = ()
    """Reasons of a stop that the procedure causes itself."""


LIVE = Procedure()


def float_on_drives(
    options: LiveOptions,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> FlownOnDrives:
    """Let the arm of a person whose arm is stored float, or that of an unknown person; see `fly_on_drives`.

    Raises:
        ExogravError: As `fly_on_drives`, or there is no file of this person.
    """
    procedure = replace(LIVE, files=stored_arm(person, options, folder))
    return fly_on_drives(options, person, folder, progress, say, wearer, procedure)


def fly_on_drives(
    options: LiveOptions,
    person: PersonForm,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
    procedure: Procedure = LIVE,
) -> FlownOnDrives:
    """Learn the arm live, verify it if the procedure says so, and let it float.

    An arm that is stored needs only the motion of a check, which refuses another person.

    Args:
        options: Options of the run.
        person: Form of the wearer.
        folder: Folder of the machine's files, and of the recording.
        progress: Called with the progress.
        say: Function that shows a line to the operator.
        wearer: Simulated wearer; None if machine and person are real.
        procedure: Command with its steps.

    Raises:
        IdentificationError: The motion contradicts the file or the form of the person.
        ConfigError: An option or a file cannot be used.
        ModelError: The task workspace has no room for a verification's postures.
        RigError: The machine is locked, a drive does not answer, or a process died before the loop began.
        RecordingError: There is no room for the recording.
    """
    files = procedure.files
    before = None if files.participant is None else read_participant(files.participant)
    options = _with_motion(options, before)
    description = load_rig(options.rig, options.side)
    refuse_motorless(description)
    told = procedure.form or form_of_wearer(
        description, person, options.simulate, wearer, None if before is None else before.person
    )
    path = (procedure.recording_in or folder) / procedure.recording_name
    refuse_small_disk(path, len(description.joints), options.loop_s)
    progress(CONNECTING, 0.0)
    with contextlib.ExitStack() as stack:
        refuse = not_ready(options, folder, description, procedure.command, say)
        drives, hands = stack.enter_context(
            drives_with_hands(options, description, say, "A live run", procedure.simulation, options.real_time, refuse)
        )
        readiness = readiness_of(options, folder, description, drives)
        serial, period_s = readiness.serial, drives.period_s
        known, key = readiness.calibration().whole, readiness.key
        assembly, machine = assemble(description, told.body), known.calibration().machine
        prepared = ControllerKnowledge(assembly, machine, table_guess(assembly, machine), 0.0, known.calibration())
        person_run = ParticipantRun(files, assembly, serial, told.body, datetime.now(UTC).replace(microsecond=0))
        belief = person_run.belief(machine)
        if person_run.warning:
            say(person_run.warning)
        prepared = prepared if belief is None else replace(prepared, x=belief[0])
        progress("Computing limits for an unknown arm" if belief is None else "Computing the person's limits", 0.0)
        limits = unknown_person(assembly, machine) if belief is None else person_believed(assembly, machine, belief)
        verification = _verification(prepared, options, options.seed) if procedure.is_verified else None
        passes = lesson_passes(assembly, options.identify_s, period_s, verification)
        passes_s = 0.0 if passes is None else period_s * len(passes.path)
        lesson = lesson_plan(
            prepared, options.identify_s, period_s, stack, verification, passes_s, belief, told.body.mass_kg
        )
        ordered = None if procedure.moves is None else OrderRings(stack, assembly.n, procedure)
        plan = LivePlan(
            description, told, prepared, limits, 0.0,
            partial(open_drives, drives, lock_step=options.waits), round(1e9 * period_s), lesson, key,
            orders=None if ordered is None else ordered.memory,
        )  # fmt: skip
        listening = stack.enter_context(Listening(options.record_streams)) if options.record_streams else None
        lsl = streaming_of(options, description, period_s, listening)
        if not options.simulate:
            _await_enter(say, procedure.ready)
        said = {
            **drawn_by(options),
            "hashes": person_run.hashes,
            "settings": {"options": options.recorded(), "machine": serial},
        }
        loop_s = options.loop_s + passes_s
        performed = _performed(procedure, hands, prepared, period_s, progress, ordered, loop_s + BUSY_S)
        # A procedure ends before the loop of the guard, so that its error states the reason.
        loop_s += 0.0 if performed is None else BUSY_S + LONGEST_DESCENT_S
        watch = PersonWatch(progress, lambda running: procedure.acts(running, hands), performed)
        with contextlib.nullcontext() if performed is None else performed:
            flown = fly_plan(plan, loop_s, path, said, watch, watch.begin, is_tested=True, lsl=lsl)
        procedure.afterwards(drives, hands)
    lock_after_fault(key, flown.report, procedure.on_purpose)
    watch.refuse(files.participant)
    kept = keep_flown(person_run, prepared, flown)
    if performed is not None and performed.failure is not None:
        raise _incomplete(performed.failure, flown, options, folder) from performed.failure
    figures = live_figures(
        options.rig, flown, wearer, prepared, f"passed: {key.file}", lsl, listening, machine=serial
    )  # fmt: skip
    figures = replace(figures, person=kept)
    return FlownOnDrives(flown, figures, prepared, wearer, verification, told.body, serial, belief is not None)


def _with_motion(options: LiveOptions, before: StoredParticipant | None) -> LiveOptions:
    """Return the options with the motion that this person needs.

    Raises:
        ConfigError: The person is unknown, and there is no motion.
    """
    if before is not None:
        return replace(options, identify_s=motion_needed_s(before, options.identify_s or MOTION_S))
    if not options.identify_s:
        raise ConfigError(
            "--identify is 0: the arm of a wearer in a machine on drives is learned live. Give --identify 60, or at "
            "least 10, or --participant CODE for a stored arm."
        )
    return options


class OrderRings:
    """Memory between a procedure that moves the arm and control, for the time of a flight."""

    def __init__(self, stack: contextlib.ExitStack, joints: int, procedure: Procedure):
        """Create the memory. It lives as long as `stack`."""
        size = OrderMemory(joints, taught=procedure.taught, leading=procedure.leading)
        self.orders = stack.enter_context(contextlib.closing(size.order_ring()))
        self.followed = stack.enter_context(contextlib.closing(size.followed_ring()))
        self.memory = replace(size, orders=self.orders.name, followed=self.followed.name)


def _performed(
    procedure: Procedure,
    hands: Hands,
    prepared: ControllerKnowledge,
    period_s: float,
    progress: Progress,
    ordered: OrderRings | None,
    longest_s: float,
) -> LiveProcedure | None:
    if ordered is not None and (moves := procedure.moves) is not None:
        progress("Preparing the person's limits", 0.0)
        model = ArmModel(prepared.assembly, prepared.machine)
        limits = LimitsMaker(prepared.assembly, prepared.machine, prepared.x)

        def moved(machine: LiveFloat, shown: Progress) -> None:
            rings = ordered.orders, ordered.followed
            moves(LiveMoved(machine, rings, limits, model, period_s, shown), hands, shown)

        return LiveProcedure(moved, prepared, period_s, progress, longest_s)
    if (performs := procedure.performs) is None:
        return None
    return LiveProcedure(
        lambda machine, shown: performs(machine, hands, shown), prepared, period_s, progress, longest_s
    )


def _incomplete(failure: BaseException, flown: LiveResult, options: LiveOptions, folder: Path) -> BaseException:
    """Return the error of a procedure that ended early, with the stop that was its cause."""
    if not isinstance(failure, RigError):
        return failure
    report = flown.report
    whys = [f"It stopped after {latch.at_s:.1f} s: {latch.cause}" for latch in report.latches[:1]]
    why = "".join(f" {one}" for one in [*whys, report.failure] if one)
    test = same_machine("rig self-test", options, folder)
    return RigError(
        f"{failure}{why} Recording until then: {flown.path}. After a fault test the machine again (`{test}`), then "
        "repeat."
    )


class PersonWatch:
    """Progress of a live run that lets the arm down if the motion contradicts the person's file or form."""

    def __init__(
        self,
        progress: Progress,
        acts: Callable[[Running], object] = lambda _: None,
        performed: LiveProcedure | None = None,
    ):
        """Pass the progress on to `progress`, and the running processes to `acts` and to a procedure."""
        self._progress, self._acts, self._performed, self._running = progress, acts, performed, None
        self.is_contradicted = False
        """True if the motion contradicts the file."""
        self.refusal = ""
        """Verdict that refuses the form; empty without one."""

    def begin(self, running: Running) -> None:
        """Take the running processes."""
        self._running = running
        if self._performed is not None:
            self._performed.begin(running)

    def refuse(self, known_arm: Path | None) -> None:
        """Refuse a person whom the motion contradicts.

        Raises:
            IdentificationError: The motion contradicts the person's file or form.
        """
        if self.refusal:
            raise IdentificationError(f"{self.refusal} The arm was let down. Correct the form, then repeat.")
        if self.is_contradicted:
            raise IdentificationError(
                f"{known_arm} does not fit this arm: another person's file, or a large change. The arm was let down, "
                f"and the file is unchanged. Check the code, and any load in the hand. If both are right: {AGAIN}"
            )

    def __call__(self, text: str, share: float) -> None:
        """Look at the worker's newest report, several times a second."""
        if self._performed is None or not self._performed.has_begun:
            self._progress(text, share)
        if self._running is not None:
            self._acts(self._running)
        worker = None if self._running is None else self._running.worker
        if self._running is None or worker is None or worker.judged is None or self.is_contradicted or self.refusal:
            return
        self.is_contradicted, self.refusal = worker.judged.is_contradicted, worker.judged.refusal
        if self.is_contradicted or self.refusal:
            self._running.stop()


def _verification(prepared: ControllerKnowledge, options: LiveOptions, seed: int) -> Verification:
    """Plan postures that the identification does not visit, with the arm of the table: this arm is not known yet."""
    model = ArmModel(prepared.assembly, prepared.machine)
    seen = identification_motion(prepared.assembly, options.identify_s, SEEN_EVERY_S).q
    return Verification(unseen_postures(model, prepared.x, seen, seed), seed)


def _await_enter(say: Say, ready: str) -> None:
    say(ready)
    while not is_line_typed(sys.stdin, 0.5):
        pass
