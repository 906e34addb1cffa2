"""Session of `exograv run train` in lock-step, from the preparation to the last window and the report."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from exograv.errors import ConfigError, RecordingError, RigError
from exograv.experiment.recorded_run import has_window
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import read_machine
from exograv.loop.run_settings import RunSettings, TwinRun
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.recording import RecordingWriter
from exograv.recording.disk import refuse_small_disk
from exograv.results import MERGED, json_value
from exograv.storage.session_checkpoint import (
    SESSION_FILE,
    KeptRests,
    KeptSession,
    KnownPerson,
    checkpoint_path,
    read_kept,
    refuse_kept,
)
from exograv.task.events import Interrupted, Resume, Start
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import TASK_TOPIC, checkpoint_sink, marker_sink, recording_sink
from exograv.task.run import TaskRun
from exograv.task.totals import TotalsFigures

from .interface import TrainingMachine
from .lockstep_screen import BetweenWindows, LockstepScreen
from .options import TrainOptions
from .preparation import PREPARATION, PreparationFigures, Ready
from .request import TrainingRequest, asked_for
from .rest import learn_in_rest, with_rest
from .session_check import check_between, with_check
from .verification import verify_between

PREPARING_S = 420.0
"""Upper limit of the machine's time before the first window: calibration, self-test, identification."""

AROUND_WINDOW_S = 60.0
"""Upper limit of the simulated time around a window: ramps, ways, and the parts of the rests in which the arm lies."""

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
    session_s: float
    """Duration on the machine's clock, with calibration and rests [s]."""
    simulated_s: float
    """Part of the duration that was simulated tick by tick [s]."""
    wall_s: float
    recording_MB: float
    report: Path
    recording: Path


MachineFor = Callable[[TrainingRequest, KeptSession | None], TrainingMachine]
"""Function that makes the machine of a request, and of the checkpoint of an interrupted session."""


def run_training(
    options: TrainOptions, folder: Path, progress: Progress, machine_of: MachineFor | None = None
) -> TrainResult:
    """Run a session of a protocol in lock-step.

    Args:
        options: Options of the session.
        folder: Folder of the files.
        progress: Called with the progress.
        machine_of: Function that makes the machine; the twin by default.

    Raises:
        ConfigError: An option or a file is not valid, or there is no run to continue.
        ExogravError: Machine, wearer or run was refused or stopped.
        KeyboardInterrupt: Ctrl-C was pressed. The checkpoint for `--resume` is written.
    """

    def twin(asked: TrainingRequest, _before: KeptSession | None) -> TrainingMachine:
        from .twin_machine import TwinMachine  # MuJoCo

        return TwinMachine(options, asked.rig, asked.loaded.settings, progress)

    training = _Training(options, folder, progress, machine_of or twin)
    try:
        return training.run()
    finally:
        training.close()


class _Training:
    """Run of the command."""

    def __init__(self, options: TrainOptions, folder: Path, progress: Progress, machine_of: MachineFor):
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
        self._machine: TrainingMachine = machine_of(self._asked, self._before)
        with contextlib.ExitStack() as stack:
            stack.callback(self._machine.close)
            self._refuse_machine()
            self._plan = TaskPlan(self._asked.loaded, self._asked.exo, self._machine.screen)
            self._machine.refuse_files()
            stack.pop_all()

    def close(self) -> None:
        """Release the machine, and end its processes."""
        self._machine.close()

    def run(self) -> TrainResult:
        """Run the session to its end, or to an interruption."""
        try:
            return self._run()
        except (RigError, RecordingError) as error:
            is_of_preparation = isinstance(error, RigError) and not self._kept_path.exists()
            if is_of_preparation or "--resume" in str(error):
                raise
            raise type(error)(f"{error} {how_to_go_on(self._options, self._folder)}") from error

    def _run(self) -> TrainResult:
        before, joints = self._before, self._machine.description.joints
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
            passed_s = self._fly(run, ready, recording)
            t = ready.pilot.rig.t
            self._write_result(recording, run, ready.figures, t, passed_s)
        return self._result(run, ready.figures, t, passed_s)

    def _continued(self, before: KeptSession) -> RecordingWriter:
        """Continue the recording from the state of the checkpoint.

        The command may have ended between the two files. A record without a checkpoint is not part of the run: a window
        that is only closed in the recording would be run and counted again.
        """
        kept = None if before.records is None else {TASK_TOPIC: before.records}
        return RecordingWriter.continued(self._recording_path, kept=kept)

    def _left_s(self, run: TaskRun) -> float:
        """Time to simulate from the next window on [s]."""
        windows, timeline = self._plan.protocol.windows, self._plan.timeline
        number = run.state.next_window(windows.numbers)
        if number is None:
            return 0.0
        whole_s = timeline.duration_s - timeline.approach_s(number)
        if self._machine.pass_time is None or not self._plan.is_clocked:
            return whole_s
        count = sum(1 for one in windows.numbers if one >= number)
        return min(whole_s, count * (windows.duration_s + AROUND_WINDOW_S))

    def _reported(self, run: TaskRun, before: KeptSession) -> TrainResult:
        """Write the missing results of a complete run whose command was ended while it closed its files."""
        report = self._report_path
        if report.exists() and report.stat().st_mtime >= self._kept_path.stat().st_mtime:
            raise ConfigError(
                f"The run in {self._kept_path} is over and has its report, {report}. Start the next session with "
                "--session."
            )
        figures = self._with_person(PREPARATION.validate_python(before.before), before.person, before.rests)
        with self._continued(before) as recording:
            if not recording.count("/result"):
                self._write_result(recording, run, figures, before.t, before.passed_s)
        return self._result(run, figures, before.t, before.passed_s)

    def _write_result(
        self, recording: RecordingWriter, run: TaskRun, figures: PreparationFigures, t: float, passed_s: float
    ) -> None:
        recording.write("/result", t, {
            "task": {**json_value(run.totals().figures()), **json_value(figures)}, "rig": self._asked.rig,
            "joints": list(self._machine.description.joints), "disturbance_level": self._options.level,
            "world": self._options.world, "seed": self._options.seed, "simulated_s": round(t - passed_s, 3),
        })  # fmt: skip

    @property
    def _report_path(self) -> Path:
        return self._folder / f"{self._options.name}.html"

    def _result(self, run: TaskRun, preparation: PreparationFigures, t: float, passed_s: float) -> TrainResult:
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
            session_s=round(t, 3),
            simulated_s=round(t - passed_s, 3),
            wall_s=round(time.perf_counter() - self._begun, 2),
            recording_MB=round(1e-6 * self._recording_path.stat().st_size, 1),
            report=report,
            recording=self._recording_path,
        )

    def _refuse_machine(self) -> None:
        description = self._machine.description
        if description.side == "both":
            raise ConfigError(
                f"{description.name} is for both arms, but the task needs one. Choose a machine for one arm."
            )
        if description.motorless and self._asked.loaded.settings.exo == "active":
            raise ConfigError(
                f"{description.name} has no motor at {', '.join(description.motorless)}; protocol "
                f"'{self._asked.loaded.settings.name}' needs an active machine. Choose one with motors (exograv rigs)."
            )

    def _ready(self, recording: RecordingWriter) -> Ready:
        before = self._before
        # The ticks of a verification, or of an earlier continuation, may be later than the checkpoint.
        t = 0.0 if before is None else max(before.t, recording.t_last) + AWAY_S
        ready = self._machine.ready(recording, before, t)
        if before is not None:
            ready.figures = PREPARATION.validate_python(before.before)
        return ready

    def _fly(self, run: TaskRun, ready: Ready, recording: RecordingWriter) -> float:
        """Run the windows; return the time of rests that has passed without ticks [s]."""
        rig, before = ready.pilot.rig, self._before
        passed_before_s = 0.0 if before is None else before.passed_s
        page = f"simulated-{run.state.epoch + (before is not None)}"
        seat = self._machine.seat(self._plan, page, None if before is None else before.learned)

        def keep() -> None:
            # First the recording: an acknowledged touch, and each tick of a complete window, is in both files.
            recording.sync()
            kept = KeptSession(
                options=self._options.kept, t=rig.t, passed_s=passed_before_s + machine.passed_s, run=run.kept(),
                records=recording.count(TASK_TOPIC),
                person=ready.person, rests=None if ready.learner is None else ready.learner.kept,
                before=json_value(ready.figures), learned=self._machine.learned,
            )  # fmt: skip
            SESSION_FILE.write(self._kept_path, kept)

        outlet = self._outlet(rig.period_s)
        run.sinks = (
            recording_sink(recording),
            *(() if outlet is None else (marker_sink(outlet.push_sample),)),
            checkpoint_sink(lambda _t: keep()),
        )

        def verify() -> Controller:
            after = len(run.state.complete)
            verified = [*(ready.figures.verified or []), verify_between(ready, self._machine.day + after, after)]
            ready.figures = replace(ready.figures, verified=verified)
            return ready.controller

        def check() -> Controller:
            with_check(ready, check_between(ready, len(run.state.complete), self._options.identify_again))
            return ready.controller

        def learn() -> Controller:
            with_rest(ready, learn_in_rest(ready, len(run.state.complete)))
            return ready.controller

        between = (
            BetweenWindows(int(self._options.learn_in_rests), "learning in the rest", learn),
            BetweenWindows(self._options.check_every, "session check", check),
            BetweenWindows(self._options.verify_every, "verification", verify),
        )
        machine = LockstepScreen(run, ready.pilot, ready.controller, seat, between, pass_time=self._machine.pass_time)
        ready.pilot.begin("task")
        for event in (Start,) if before is None else (Interrupted, Resume):
            run.feed(event(t=rig.t))
        machine.fly(*self._machine.sources(recording))
        keep()
        rests = None if ready.learner is None else ready.learner.kept
        ready.figures = self._with_person(ready.figures, ready.person, rests)
        keep()
        if outlet is not None and outlet.have_consumers():
            time.sleep(LAST_MARKERS_S)
        return passed_before_s + machine.passed_s

    def _with_person(
        self, figures: PreparationFigures, known: KnownPerson | None, rests: KeptRests | None
    ) -> PreparationFigures:
        """Write the arm that the rests have shown into the participant's file; return the figures with the result."""
        if not self._options.learn_in_rests or known is None or figures.person_kept is not None:
            return figures
        checked = None if rests is None else rests.checked
        written = self._machine.person_run().keep_learned(checked, read_machine(known.machine))
        if isinstance(written, NotKept):
            self._progress(written.why, 1.0)
        elif written is not None and written.warning:
            self._progress(written.warning, 1.0)
        return replace(figures, person_kept=isinstance(written, KeptParticipant))

    def _outlet(self, period_s: float):
        """Open the stream of markers; None without `--lsl`."""
        if not self._options.lsl:
            return None
        from exograv.runtime.lsl.outlets import OutletsJob, marker_outlet  # The import starts threads.

        description = self._machine.description
        outlet = marker_outlet(OutletsJob(description.name, description.joints, period_s))
        self._progress("Waiting for a program that receives the markers", 0.0)
        outlet.wait_for_consumers(LISTENER_S)  # Markers sent before are lost.
        return outlet

    def _settings(self) -> RunSettings:
        options, asked = self._options, self._asked
        # The path of a file changes no result. The hashes state which files were read.
        places = dict.fromkeys(("calibration", "person_file", "allocation", "drives", "participants", "aircraft_file"))
        settings = {
            "options": json_value(options) | places | {"rig": asked.rig, "resume": False, "lsl": False},
            "protocol": asked.loaded.recorded,
        }
        hashes = {"protocol": asked.loaded.sha256}
        if asked.allocation_sha256 is not None:
            hashes["allocation"] = asked.allocation_sha256
        if options.aircraft_file is not None:
            hashes["aircraft_file"] = sha256(options.aircraft_file.read_bytes()).hexdigest()
        return self._machine.settings(settings, hashes)


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
    if recording.exists() and has_window(recording):
        raise ConfigError(
            f"{recording} holds windows of this session, and its checkpoint is missing. Move the recording to another "
            "folder to keep it, or give another --session or --out."
        )


def _kept_path(options: TrainOptions, folder: Path) -> Path:
    return checkpoint_path(folder, options.name, is_simulated=True)
