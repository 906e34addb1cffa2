"""Drives in another process as a `TrainingMachine`, on one virtual clock with the participant behind them.

This process holds neither the twin nor its truth: it reaches the machine by the frames of its bus, and the participant
by a line with page and touches.
"""

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from exograv import motion
from exograv.errors import ConfigError, RigError
from exograv.identification.core.prior import prior
from exograv.laboratory.participant.screen_session import EventSource
from exograv.live.on_drives.connection import CONNECTING, Say, drives_of, not_ready, readiness_of
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits, refuse_motorless
from exograv.loop.mode_ramp import fade
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import TAKING
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.run_settings import Draw, RunSettings, run_settings
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.recording import RecordingWriter
from exograv.results import JsonObject
from exograv.rig.drives.opening import DrivenRig, open_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.safety.envelope import Envelope
from exograv.safety.modes import REST_BEFORE_RAMP_S, Mode
from exograv.storage.session_checkpoint import KeptSession, LearnedState
from exograv.storage.session_readiness import participants_in
from exograv.task.participant_line import Room
from exograv.task.plan import TaskPlan

from .options import TrainOptions
from .preparation import Ready, SelfTestPassed, WornMachine, known_again, known_arm, person_run, remembered, unknown_arm
from .remote_seat import ParticipantLine, RemoteSeat
from .request import TrainingRequest

COMMAND = "exograv run train --simulate --virtual-clock"
"""Command as the recording states it."""

TAKING_TEXT = "Taking the arm"
LETS_GO_S = 1.5
"""Time for a wearer to let go of an arm that the machine carries, assumed [s]."""

SLOW_RAD_S = 0.1
"""Speed of an arm that is held while the machine takes it, assumed [rad/s]."""


class DrivesMachine:
    """Machine that is ready, with a participant of its seed, in another process."""

    def __init__(
        self,
        options: TrainOptions,
        asked: TrainingRequest,
        before: KeptSession | None,
        folder: Path,
        progress: Progress,
        say: Say,
    ):
        """Check that the machine is ready, and start its process.

        Args:
            options: Options of the session.
            asked: Protocol and machine.
            before: Checkpoint of an interrupted session; None for a new one.
            folder: Folder of the machine's files.
            progress: Called with the progress.
            say: Function that shows a line to the operator.

        Raises:
            ExogravError: The machine is not ready, or a file cannot be used.
        """
        self._options, self._progress = options, progress
        self._people = options.participants or participants_in(folder)
        self._asked = replace(options, rig=asked.rig)
        self.description = description = load_rig(asked.rig, options.side)
        refuse_motorless(description)
        protocol = asked.loaded.settings
        if protocol.opening != "clock":
            raise ConfigError(
                f"Protocol '{protocol.name}' does not open its windows by the clock, and --virtual-clock has no "
                "aircraft. Run it on the twin, without --simulate, or at the console."
            )
        self.day = 0  # Only a verification needs it, and --verify-every acts on the twin only.
        run = 0 if before is None else round(before.t)
        with contextlib.ExitStack() as stack:
            progress(CONNECTING, 0.0)
            refuse = not_ready(self._asked, folder, description, "run train", say)
            port = free_port()
            wearer = ("--worn", "--person", "virtual", "--protocol", options.protocol, "--line", str(port))
            day = ("--donning", str(options.donning), "--run", str(run))
            drives, tell = stack.enter_context(drives_of(self._asked, description, (*wearer, *day), False, refuse))
            self._line = stack.enter_context(contextlib.closing(ParticipantLine(port)))
            self._drives = drives
            self._hear: Callable[[str], object] = tell or (lambda _line: None)
            self._readiness = readiness_of(self._asked, folder, description, drives)
            self._stack = stack.pop_all()
        told = self._line.introduced
        self._form = WearerForm(Body(told.height_m, told.mass_kg, told.sex, dict(told.lengths_m)), told.lengths_m)
        self.screen, self._assembly = told.screen, assemble(description, self._form.body)
        self._rig: DrivenRig | None = None

    def refuse_files(self) -> None:
        """Check the participant's file."""
        self.person_run()

    def settings(self, settings: JsonObject, hashes: dict[str, str]) -> RunSettings:
        """Describe the run, with room and participant as they introduce themselves."""
        options = self._options
        draw = Draw(options.level, options.world, options.seed)
        around = {"machine": self._readiness.serial, **self._line.introduced.recorded}
        return run_settings(self.description, self._form, COMMAND, draw, settings | around, hashes)

    def ready(self, recording: RecordingWriter, before: KeptSession | None, t: float) -> Ready:
        """Open the bus, take the arm, then check and identify it."""
        self._people.mkdir(parents=True, exist_ok=True)
        known_machine = self._readiness.calibration().whole.calibration()
        rig = open_drives(self._drives, lock_step=True)
        rig.begin_at(t)
        self._rig = self._stack.enter_context(rig)
        pilot = Pilot(
            rig,
            known_machine.machine.actuators,
            Envelope(limits(self.description), rig.period_s),
            recording,
            self._progress,
            key=self._readiness.key,
        )
        if before is not None and before.person is not None:
            known = remembered(before.person, self._assembly, t)
            return known_again(self._taken(pilot, known), before.person, before.rests, self.person_run())
        guess = table_guess(self._assembly, known_machine.machine)
        known = ControllerKnowledge(self._assembly, known_machine.machine, guess, t, known_machine)
        prepare = unknown_arm if self._options.learn_in_rests else known_arm
        return prepare(self._taken(pilot, known), self.person_run(), SelfTestPassed(True))

    def seat(self, plan: TaskPlan, page: str, learned: LearnedState | None) -> RemoteSeat:
        """Seat the participant before the screen."""
        if self._rig is None:
            raise RigError("The machine is not prepared yet. Call `ready` first.")
        return RemoteSeat(self._line, page, learned)

    @property
    def learned(self) -> LearnedState | None:
        """State that the participant keeps between sessions."""
        return self._line.learned

    @property
    def pass_time(self) -> Callable[[float], object] | None:
        """None: the clock of drives passes by their frames."""
        return None

    def sources(self, recording: RecordingWriter) -> tuple[EventSource, ...]:
        """Return no further source."""
        return ()

    def close(self) -> None:
        """Switch the drives off, and end their process."""
        self._stack.close()

    def _taken(self, pilot: Pilot, known: ControllerKnowledge) -> WornMachine:
        """Carry the machine alone for a second, then take the arm while the wearer lets go."""
        rig, machine = pilot.rig, known.machine
        controller = ArmController(known.assembly, machine, known.x, rig.period_s)
        controller.mode.drive = TAKING.drive.goal(is_known=False)
        controller.mode.gravity_level = 1.0
        believed = prior(known.assembly, machine)
        pilot.worn = PersonLimitsManager(pilot.envelope, known.assembly, machine, believed[0])
        pilot.worn.expect(*believed, SLOW_RAD_S)
        if pilot.envelope.person is not None:
            pilot.envelope.person.gravity_level = 1.0
        pilot.begin(TAKING)
        posture = pilot.q.copy()
        for mode, seconds in ((Mode.EXO_ONLY, REST_BEFORE_RAMP_S), (Mode.RAMP_IN, 0.0), (Mode.FLOATING, LETS_GO_S)):
            self._hear(f"mode {mode.name.lower()}")
            if mode is Mode.RAMP_IN:
                fade(pilot, controller, "gravity_level", 0.0, posture)
            else:
                pilot.run(controller, motion.hold(posture, seconds, rig.period_s), TAKING_TEXT)
        return WornMachine(pilot, controller, known, lambda is_there: self._line.tell(Room(is_there=is_there)))

    def person_run(self) -> ParticipantRun:
        """Read the participant's file, if there is one."""
        options = self._options
        file = self._people / f"{options.participant}.toml"
        return person_run(file, options.participant, self._assembly, self._readiness.serial, self._form.body)
