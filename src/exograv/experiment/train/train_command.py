"""Session of `exograv run train --simulate`: from empty machine to last window, in lock-step and from one seed."""

import time
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError, RecordingError, RigError
from exograv.laboratory.participant.aircraft_feed import AircraftFeed
from exograv.laboratory.participant.habits import Habits, register
from exograv.laboratory.participant.lockstep_screen import LockstepScreen
from exograv.laboratory.participant.screen_session import ScreenSeat
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.laboratory.provenance import RunSettings, run_settings
from exograv.laboratory.result_rows import TwinRun
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.next_command import calibration_command
from exograv.recording import RecordingWriter, read_recording
from exograv.recording.disk import refuse_small_disk
from exograv.results import MERGED, json_value
from exograv.rig.twin import Twin, day_seed
from exograv.rig.twin.twin import PERIOD
from exograv.safety.envelope import Envelope
from exograv.storage.calibration_file import take_calibration
from exograv.storage.session_checkpoint import SESSION_FILE, KeptSession, checkpoint_path, read_kept, refuse_kept
from exograv.task.events import Interrupted, Resume, Start
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import TASK_TOPIC, aircraft_sink, checkpoint_sink, marker_sink, recording_sink
from exograv.task.run import TaskRun
from exograv.task.totals import TotalsFigures

from .options import TrainOptions
from .preparation import (
    PREPARATION,
    PreparationFigures,
    Ready,
    known_again,
    known_arm,
    person_run,
    recording_only,
    tested_machine,
)
from .recording_pilot import RecordingPilot
from .request import TrainingRequest, asked_for
from .verification import verify_between

PREPARING_S = 420.0
"""Upper limit of the machine's time before the first window: calibration, self-test, identification."""

LISTENER_S = 5.0
"""Time for a running recorder of Lab Streaming Layer to find the stream. Lock-step does not wait during the run."""

LAST_MARKERS_S = 0.5
"""Time for the last markers to leave this process."""

AWAY_S = 300.0
"""Time between the last tick of a run and its continuation [s]."""


@dataclass(frozen=True)
class TrainResult:
    """Result of `exograv run train`."""

    protocol: str
    participant: str
    session: int
    touched: TotalsFigures = field(metadata=MERGED)
    is_complete: bool
    is_whole_protocol: bool
    attempts: int
    """Number of windows that were opened."""
    preparation: PreparationFigures = field(metadata=MERGED)
    run: TwinRun = field(metadata=MERGED)
    simulated_s: float
    wall_s: float
    recording_MB: float
    report: Path
    recording: Path


def run_training(options: TrainOptions, folder: Path, progress: Progress) -> TrainResult:
    """Run a session of a protocol.

    Raises:
        ConfigError: An option or a file is not valid, or there is no run to continue.
        ExogravError: Machine, wearer or run was refused or stopped.
        KeyboardInterrupt: Ctrl-C was pressed. The checkpoint for `--resume` is written.
    """
    return _Training(options, folder, progress).run()


class _Training:
    """Run of the command."""

    def __init__(self, options: TrainOptions, folder: Path, progress: Progress):
        self._begun = time.perf_counter()
        self._options, self._progress = options, progress
        self._asked: TrainingRequest = asked_for(options)
        self._folder = folder
        self._recording_path, self._kept_path = folder / f"{options.name}.mcap", _kept_path(options, folder)
        self._before: KeptSession | None = None
        if options.resume and not is_unbegun(self._kept_path, self._recording_path):
            self._before = read_kept(self._kept_path, options.kept)
        else:
            refuse_kept(self._kept_path)
            refuse_windows(self._recording_path)
        self._laboratory: VirtualLaboratory = draw_laboratory(
            self._asked.rig, options.side, options.level, options.seed, donning=options.donning, world=options.world
        )
        self._day = day_seed(options.seed, options.donning)
        self._refuse_machine()
        protocol = self._asked.loaded.settings
        self._room = SimulatedRoom()
        self._plan = TaskPlan(self._asked.loaded, self._asked.exo, self._room.calibration)
        self._assembly = self._laboratory.assembly()
        self._refuse_files()
        self._surroundings = self._room.around(self._assembly, protocol.target)

    def run(self) -> TrainResult:
        try:
            return self._run()
        except (RigError, RecordingError) as error:
            is_of_preparation = isinstance(error, RigError) and not self._kept_path.exists()
            if is_of_preparation or "--resume" in str(error):
                raise
            raise type(error)(f"{error} {how_to_go_on(self._options, self._folder)}") from error

    def _run(self) -> TrainResult:
        before, joints = self._before, self._laboratory.description.joints
        run = TaskRun(self._plan) if before is None else TaskRun.from_kept(self._plan, before.run)
        if before is not None and run.state.status in ("stopped", "finished"):
            return self._reported(run, before)
        prepares_s = PREPARING_S if before is None else 0.0
        refuse_small_disk(self._recording_path, len(joints), self._left_s(run) + prepares_s)
        if before is None:
            recording = RecordingWriter(self._recording_path, joints, json_value(self._settings()))
        else:
            recording = self._continued(before)
        with recording:
            ready = self._ready(recording)
            self._fly(run, ready, recording)
            self._write_result(recording, run, ready.figures, ready.twin.t)
        return self._result(run, ready.figures, ready.twin.t)

    def _continued(self, before: KeptSession) -> RecordingWriter:
        """Continue the recording from the state of the checkpoint.

        The command may have ended between the two files. A record without a checkpoint is not part of the run: a window
        that is only closed in the recording would be run and counted again.
        """
        kept = None if before.records is None else {TASK_TOPIC: before.records}
        return RecordingWriter.continued(self._recording_path, kept=kept)

    def _left_s(self, run: TaskRun) -> float:
        """Time of the schedule from the next window on [s]."""
        timeline, number = self._plan.timeline, run.state.next_window(self._plan.protocol.windows.numbers)
        return 0.0 if number is None else timeline.duration_s - timeline.approach_s(number)

    def _reported(self, run: TaskRun, before: KeptSession) -> TrainResult:
        """Write the missing results of a complete run whose command was ended while it closed its files."""
        report = self._report_path
        if report.exists() and report.stat().st_mtime >= self._kept_path.stat().st_mtime:
            raise ConfigError(
                f"The run in {self._kept_path} is over and has its report, {report}. Start the next session with "
                "--session."
            )
        figures = PREPARATION.validate_python(before.before)
        with self._continued(before) as recording:
            if not recording.count("/result"):
                self._write_result(recording, run, figures, before.t)
        return self._result(run, figures, before.t)

    def _write_result(self, recording: RecordingWriter, run: TaskRun, figures: PreparationFigures, t: float) -> None:
        recording.write("/result", t, {
            "task": {**json_value(run.totals().figures()), **json_value(figures)}, "rig": self._asked.rig,
            "joints": list(self._laboratory.description.joints), "disturbance_level": self._options.level,
            "world": self._options.world, "seed": self._options.seed, "simulated_s": round(t, 3),
        })  # fmt: skip

    @property
    def _report_path(self) -> Path:
        return self._folder / f"{self._options.name}.html"

    def _result(self, run: TaskRun, preparation: PreparationFigures, t: float) -> TrainResult:
        """Write the report; return the result of the command."""
        self._progress("Writing the report", 0.0)
        from exograv.report.of_recording.recording_report import write_report  # Matplotlib: 0.4 s

        report = write_report(self._recording_path, self._report_path)
        complete = run.state.status == "finished" or run.state.complete >= set(self._plan.protocol.windows.numbers)
        return TrainResult(
            protocol=self._plan.protocol.name,
            participant=self._options.participant,
            session=self._options.session,
            touched=run.totals().figures(),
            is_complete=complete,
            is_whole_protocol=self._asked.is_whole,
            attempts=len(run.state.windows),
            preparation=preparation,
            run=TwinRun(self._asked.rig, self._options.level, self._options.world, self._options.seed),
            simulated_s=round(t, 3),
            wall_s=round(time.perf_counter() - self._begun, 2),
            recording_MB=round(1e-6 * self._recording_path.stat().st_size, 1),
            report=report,
            recording=self._recording_path,
        )

    def _refuse_files(self) -> None:
        """Check the files of machine and person before the recording begins, and not after minutes of preparation."""
        options, laboratory = self._options, self._laboratory
        person_run(options, laboratory, self._assembly)
        if options.calibration is not None:
            make, now = calibration_command(options), datetime.now(UTC)
            take_calibration(options.calibration, laboratory.description, laboratory.serial, now, make)

    def _refuse_machine(self) -> None:
        description = self._laboratory.description
        if description.side == "both":
            raise ConfigError(
                f"{description.name} is for both arms, but the task needs one. Choose a machine for one arm."
            )
        if description.motorless and self._asked.loaded.settings.exo == "active":
            raise ConfigError(
                f"{description.name} has no motor at {', '.join(description.motorless)}; protocol "
                f"'{self._asked.loaded.settings.name}' needs an active machine. Choose one with motors (exograv rigs)."
            )

    @property
    def _records_only(self) -> bool:
        """True if the machine gives no torque.

        It has no motors, or the gravity level changes in flight, which no model includes.
        """
        return bool(self._laboratory.description.motorless) or self._plan.protocol.opening == "aircraft"

    def _pilot_of(self, recording: RecordingWriter, twin: Twin, actuators: ActuatorGain) -> Pilot:
        envelope = Envelope(limits(self._laboratory.description, self._records_only), twin.period_s)
        kind = RecordingPilot if self._records_only else Pilot
        return kind(twin, actuators, envelope, recording, self._progress)

    def _ready(self, recording: RecordingWriter) -> Ready:
        def pilot_of(twin: Twin, actuators: ActuatorGain) -> Pilot:
            return self._pilot_of(recording, twin, actuators)

        laboratory, surroundings, before, seed = self._laboratory, self._surroundings, self._before, self._day
        # The ticks of a verification, or of an earlier continuation, may be later than the checkpoint.
        t = 0.0 if before is None else max(before.t, recording.t_last) + AWAY_S
        if before is not None:
            # After the interruption muscles and noise must not repeat the same sequence.
            seed += round(t)
        if self._records_only:
            ready = recording_only(laboratory, surroundings, seed, pilot_of, t)
        elif before is not None and before.person is not None:
            ready = known_again(laboratory, surroundings, before.person, t, seed, pilot_of)
        else:
            tested = tested_machine(self._options, laboratory, self._progress)
            ready = known_arm(self._options, laboratory, surroundings, tested, seed, pilot_of)
        if before is not None:
            ready.figures = PREPARATION.validate_python(before.before)
        return ready

    def _participant(self, twin: Twin) -> PointingPerson:
        laboratory, protocol = self._laboratory, self._plan.protocol
        person = PointingPerson(
            laboratory.own_arm(),
            laboratory.worn_inertia(),
            self._surroundings,
            self._room.on_panel(*self._room.target_px(protocol.target)),
            protocol.pace.too_short.shape,
            self._options.seed,
            twin.period_s,
            Habits(interval_s=protocol.windows.interval_s),
        )
        person.inner_ear = lambda: twin.room_gravity
        person.begin_day(self._day)
        if self._before is not None and self._before.learned is not None:
            person.remember(self._before.learned)
        return person

    def _fly(self, run: TaskRun, ready: Ready, recording: RecordingWriter) -> None:
        twin = ready.twin
        participant = self._participant(twin)

        def keep() -> None:
            # First the recording: an acknowledged touch, and each tick of a complete window, is in both files.
            recording.sync()
            kept = KeptSession(
                options=self._options.kept, t=twin.t, run=run.kept(), records=recording.count(TASK_TOPIC),
                person=ready.person, before=json_value(ready.figures),
                learned=participant.learned,
            )  # fmt: skip
            SESSION_FILE.write(self._kept_path, kept)

        outlet = self._outlet()
        run.sinks = (
            recording_sink(recording),
            *(() if outlet is None else (marker_sink(outlet.push_sample),)),
            checkpoint_sink(lambda _t: keep()),
        )

        def verify() -> None:
            after = len(run.state.complete)
            verified = [*(ready.figures.verified or []), verify_between(ready, self._day + after, after)]
            ready.figures = replace(ready.figures, verified=verified)

        protocol, page = self._plan.protocol, f"simulated-{run.state.epoch + (self._before is not None)}"
        seat = ScreenSeat(twin, participant, self._room, protocol.target, self._day, page)
        machine = LockstepScreen(run, ready.pilot, twin, ready.controller, seat, verify, self._options.verify_every)
        aircraft = ()
        if protocol.opening == "aircraft":
            aircraft = (AircraftFeed(protocol, twin, self._day, aircraft_sink(recording)),)
        ready.pilot.begin("task")
        for event in (Start,) if self._before is None else (Interrupted, Resume):
            run.feed(event(t=twin.t))
        machine.fly(*aircraft)
        keep()
        if outlet is not None and outlet.have_consumers():
            time.sleep(LAST_MARKERS_S)

    def _outlet(self):
        """Open the stream of markers; None without `--lsl`."""
        if not self._options.lsl:
            return None
        from exograv.runtime.lsl.outlets import OutletsJob, marker_outlet  # The import starts threads.

        description = self._laboratory.description
        outlet = marker_outlet(OutletsJob(description.name, description.joints, PERIOD))
        self._progress("Waiting for a program that receives the markers", 0.0)
        outlet.wait_for_consumers(LISTENER_S)  # Markers sent before are lost.
        return outlet

    def _settings(self) -> RunSettings:
        options, asked = self._options, self._asked
        habits = Habits(interval_s=asked.loaded.settings.windows.interval_s)
        # The path of a file changes no result. The hashes state which files were read.
        places = dict.fromkeys(("calibration", "person_file", "allocation"))
        settings = {
            "options": json_value(options) | places | {"rig": asked.rig, "resume": False, "lsl": False},
            "protocol": asked.loaded.recorded,
            "room": self._room,
            "surroundings": {
                "screen_centre_m": self._surroundings.screen_centre.tolist(),
                "screen_tilt_rad": self._surroundings.screen_tilt,
                "support_z_m": self._surroundings.support_z,
            },
            "participant_model": habits,
            "participant_constants": register(habits),
        }
        hashes = {"protocol": asked.loaded.sha256}
        if asked.allocation_sha256 is not None:
            hashes["allocation"] = asked.allocation_sha256
        command = "exograv run train --simulate"
        return run_settings(self._laboratory, command, options.level, options.seed, settings, hashes)


def how_to_go_on(options: TrainOptions, folder: Path) -> str:
    """Return the advice for a continuation after an interruption."""
    path = _kept_path(options, folder)
    if not path.exists():
        return "No window has begun. Begin again with the same command."
    return f"No complete window is lost. Continue with the same command and --resume: the checkpoint is {path}."


def is_unbegun(checkpoint: Path, recording: Path) -> bool:
    """Return True if a session ended in its preparation: it has a recording, but neither checkpoint nor windows."""
    return recording.exists() and not checkpoint.exists()


def refuse_windows(recording: Path) -> None:
    """Refuse to replace the recording of a session whose checkpoint is gone.

    Raises:
        ConfigError: The recording holds a window.
    """
    if recording.exists() and _has_window(recording):
        raise ConfigError(
            f"{recording} holds windows of this session, and its checkpoint is missing. Move the recording to another "
            "folder to keep it, or give another --session or --out."
        )


def _has_window(path: Path) -> bool:
    try:
        recording = read_recording(path)
    except RecordingError:
        return False  # a command that ends at once leaves a file without settings
    return any(message["kind"] == "window_opened" for message in recording.messages(TASK_TOPIC))


def _kept_path(options: TrainOptions, folder: Path) -> Path:
    return checkpoint_path(folder, options.name, is_simulated=True)
