"""The twin as a `TrainingMachine`, with a virtual participant."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError, RigError
from exograv.experiment.sensor_file.load import Flight, SensorFile, load_flight, windows_in
from exograv.laboratory.amplifier.wearer_emg import WearerEmg
from exograv.laboratory.participant.aircraft_feed import AircraftFeed
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.recorded_participant import recorded_participant
from exograv.laboratory.participant.screen_session import EventSource
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.twin_seat import TwinSeat
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.laboratory.preparation import Preparation, unit_gains, worn_twin
from exograv.laboratory.provenance import run_settings
from exograv.laboratory.virtual_laboratory import draw_laboratory, with_twin
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import NoTorque
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.run_settings import RunSettings
from exograv.next_command import calibration_command
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.procedures.self_test.machine_test import test_machine
from exograv.recording import RecordingWriter
from exograv.results import JsonObject
from exograv.rig.twin import Disturbances, Twin, day_seed
from exograv.safety.envelope import Envelope
from exograv.storage.calibration_file import take_calibration
from exograv.storage.session_checkpoint import KeptSession, LearnedState
from exograv.task.plan import TaskPlan
from exograv.task.protocol_schema import Protocol
from exograv.task.record_sinks import aircraft_sink

from .options import TrainOptions
from .preparation import Ready, SelfTestPassed, WornMachine, known_again, known_arm, person_run, remembered, unknown_arm
from .recording_pilot import RecordingPilot

COMMAND = "exograv run train"
"""Command as the recording states it."""


class TwinMachine:
    """Machine and participant of a seed, in this process."""

    def __init__(self, options: TrainOptions, rig: str, protocol: Protocol, progress: Progress):
        """Draw machine and participant.

        Args:
            options: Options of the session.
            rig: Name or folder of the machine.
            protocol: Protocol of the session.
            progress: Called with the progress.

        Raises:
            ConfigError: The machine cannot be read.
        """
        self._options, self._protocol, self._progress = options, protocol, progress
        drawn = draw_laboratory(
            rig, options.side, options.level, options.seed, donning=options.donning, world=options.world
        )
        disturbances = Disturbances.at_level(options.level, options.world)
        self._laboratory = with_twin(drawn, options.twin, disturbances, options.seed)
        self.day, self._room = day_seed(options.seed, options.donning), SimulatedRoom()
        self.description, self.screen = self._laboratory.description, self._room.calibration
        self._assembly = self._laboratory.assembly()
        self._surroundings = self._room.around(self._assembly, protocol.target)
        self._twin: Twin | None = None
        self._person: PointingPerson | None = None

    def refuse_files(self) -> None:
        """Check the files of machine and person."""
        options, laboratory = self._options, self._laboratory
        self.person_run()
        self._recorded_flight()
        if options.calibration is not None:
            make, now = calibration_command(options), datetime.now(UTC)
            take_calibration(options.calibration, laboratory.description, laboratory.serial, now, make)

    def settings(self, settings: JsonObject, hashes: dict[str, str]) -> RunSettings:
        """Describe the run, with room and participant."""
        options = self._options
        around = recorded_participant(self._room, self._surroundings, self._habits)
        return run_settings(self._laboratory, COMMAND, options.level, options.seed, settings | around, hashes)

    def ready(self, recording: RecordingWriter, before: KeptSession | None, t: float) -> Ready:
        """Calibrate and test the empty machine, then check and identify the arm."""
        # After an interruption muscles and noise must not repeat the same sequence.
        seed = self.day if before is None else self.day + round(t)
        if self._records_only:
            self._twin = twin = self._laboratory.twin(seed, t, surroundings=self._surroundings)
            n = len(twin.joints)
            return Ready(self._pilot(twin, unit_gains(n), recording), NoTorque(n), twin.put_surroundings)
        if before is not None and before.person is not None:
            worn = self._worn(remembered(before.person, self._assembly, t), seed, recording)
            return known_again(worn, before.person, before.rests, self.person_run())
        known, passed = self._tested()
        prepare = unknown_arm if self._options.learn_in_rests else known_arm
        return prepare(self._worn(known, seed, recording), self.person_run(), passed)

    def seat(self, plan: TaskPlan, page: str, learned: LearnedState | None) -> TwinSeat:
        """Seat the virtual participant before the screen."""
        laboratory, protocol, twin = self._laboratory, plan.protocol, self._flown
        self._person = person = PointingPerson(
            laboratory.own_arm(),
            laboratory.worn_inertia(),
            self._surroundings,
            self._room.on_panel(*self._room.target_px(protocol.target)),
            protocol.pace.too_short.shape,
            self._options.seed,
            twin.period_s,
            self._habits,
        )
        person.inner_ear = lambda: twin.room_gravity
        person.begin_day(self.day)
        if learned is not None:
            person.remember(learned)
        return TwinSeat(twin, person, self._room, protocol.target, self.day, page)

    @property
    def learned(self) -> LearnedState | None:
        """State that the participant keeps between sessions."""
        return None if self._person is None else self._person.learned

    @property
    def pass_time(self) -> Callable[[float], object] | None:
        """Function that lets time pass on the twin; None if the rests are simulated."""
        return None if self._options.whole_rests else self._pass_time

    def sources(self, recording: RecordingWriter) -> tuple[EventSource, ...]:
        """Return the aircraft of a flight protocol."""
        if self._protocol.opening != "aircraft":
            return ()
        flown = self._recorded_flight()
        return (AircraftFeed(self._protocol, self._flown, self.day, aircraft_sink(recording), flown),)

    def _pass_time(self, seconds: float) -> None:
        self._flown.pass_time(seconds)

    def _recorded_flight(self) -> Flight | None:
        """Return the flight of a file; None without one.

        Raises:
            ConfigError: No aircraft opens the windows of this protocol, or the file has fewer windows.
            RecordingError: The file cannot be used.
        """
        protocol, path = self._protocol, self._options.aircraft_file
        if path is None:
            return None
        if protocol.opening != "aircraft":
            raise ConfigError(
                f"--aircraft-file is {path}, but protocol '{protocol.name}' opens its windows by the clock. Give a "
                "protocol such as `flight`, or leave the option out."
            )
        level = protocol.windows.level_of(protocol.windows.first_number).start
        flight = load_flight(SensorFile(path), protocol.aircraft, level).samples
        windows = windows_in(flight, protocol.aircraft, level)
        if windows < protocol.windows.count:
            raise ConfigError(
                f"{path} has {windows} windows within the limits of protocol '{protocol.name}', which has "
                f"{protocol.windows.count}. "
                + (f"Give --windows {windows}." if windows else "Give the recording of a parabolic flight.")
            )
        return flight

    def close(self) -> None:
        """Do nothing: the twin needs no release."""

    @property
    def _flown(self) -> Twin:
        if self._twin is None:
            raise RigError("The twin is not prepared yet. Call `ready` first.")
        return self._twin

    @property
    def _habits(self) -> Habits:
        return Habits(interval_s=self._protocol.windows.interval_s)

    @property
    def _records_only(self) -> bool:
        """True if the machine gives no torque.

        It has no motors, or the gravity level changes in flight, which no model includes.
        """
        return bool(self.description.motorless) or self._protocol.opening == "aircraft"

    def _pilot(self, twin: Twin, actuators: ActuatorGain, recording: RecordingWriter) -> Pilot:
        envelope = Envelope(limits(self.description, self._records_only), twin.period_s)
        kind = RecordingPilot if self._records_only else Pilot
        return kind(twin, actuators, envelope, recording, self._progress)

    def _worn(self, known: ControllerKnowledge, seed: int, recording: RecordingWriter) -> WornMachine:
        worn = worn_twin(
            self._laboratory, known, seed, lambda twin, gains: self._pilot(twin, gains, recording), self._surroundings
        )
        self._twin = worn.twin
        muscles = WearerEmg(worn.twin, seed) if self._options.emg else None
        return WornMachine(worn.pilot, worn.controller, known, worn.twin.put_surroundings, muscles)

    def _tested(self) -> tuple[ControllerKnowledge, SelfTestPassed]:
        """Calibrate and self-test the empty machine. Return its controller's knowledge and the figures of the test.

        Raises:
            RigError: The self-test has failed.
            ExogravError: The calibration was refused, or the file is of another machine.
        """
        options = self._options
        preparation = Preparation(self._laboratory, options.seed, self._progress)
        known = preparation.calibrated(options.calibration, make=calibration_command(options))
        steps, busy_s = test_machine(preparation.under_test(known), self._progress)
        failed = [step for step in steps if not (step.passed or step.locks_only)]
        if failed:
            raise RigError(
                f"The self-test has failed: {failed[0].name}. {failed[0].what_to_do} No person may be in this machine "
                "before `exograv rig self-test` passes."
            )
        return replace(known, t=known.t + busy_s), SelfTestPassed(True, len(steps))

    def person_run(self) -> ParticipantRun:
        """Read the participant's file, if there is one."""
        options, laboratory = self._options, self._laboratory
        return person_run(options.person_file, options.participant, self._assembly, laboratory.serial, laboratory.body)
