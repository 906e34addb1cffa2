"""Checkpoint of a console's run beside its diary, so that another console can resume it after a crash."""

import threading
from collections.abc import Callable
from pathlib import Path

from exograv.errors import ConfigError, ExogravError
from exograv.model.rig_settings import Settings
from exograv.options import SESSIONS_MAX, OptionRecord, Side
from exograv.storage.rests_so_far import NO_RESTS, RestsSoFar
from exograv.storage.session_checkpoint import (
    SESSION_FILE,
    KeptSession,
    checkpoint_path,
    read_kept,
    refuse_kept,
    session_name,
)
from exograv.task.screen import ScreenCalibration


class RunContext(Settings):
    """Conditions of a run besides its protocol: at its start, and the rests that have taught so far."""

    side: Side | None = None
    """Side of the arm."""

    screen: ScreenCalibration | None = None

    run: str | None = None
    """Random name of the run, as in `RunStatement`; None in earlier checkpoints."""

    rests: RestsSoFar = NO_RESTS
    """Rests in which the machine has learned the arm so far."""


class RunCheckpoint:
    """Checkpoint file of one run. A separate thread writes it, because a disk may be slow and pages must not wait."""

    def __init__(self, path: Path, options: OptionRecord, resumes: bool):
        """Open the checkpoint. Nothing is written before the run begins.

        Args:
            path: File of the checkpoint.
            options: Options that must be the same when the run is resumed.
            resumes: True to resume the run in the file.

        Raises:
            ConfigError: The file exists and `resumes` is False, or it is missing or unusable and `resumes` is True.
        """
        self.path, self._options = path, options
        self.before: KeptSession | None = None
        self.circumstances = RunContext()
        """Conditions at the start of the run that is resumed."""
        self.why = ""
        """Error of the last write; empty without an error."""
        self.sync_before: Callable[[], object] = lambda: None
        """Function that forces the records of a state to the disk, called before the state is written."""

        if resumes:
            self.before = read_kept(path, options)
            self.circumstances = RunContext.model_validate(self.before.before)
        else:
            refuse_kept(path)
        self._next: KeptSession | None = None
        self._news, self._is_over = threading.Condition(), False
        self._thread = threading.Thread(target=self._write_all, name="kept run", daemon=True)
        self._thread.start()

    def keep(self, run: str, t: float, circumstances: RunContext) -> None:
        """Store the present state. On a slow disk only the newest state is written.

        Args:
            run: State of the run, from `TaskRun.kept()`.
            t: Time on the desk's clock [s].
            circumstances: Conditions at the start of the run.
        """
        said = circumstances.model_dump(mode="json")
        with self._news:
            self._next = KeptSession(options=self._options, t=t, run=run, person=None, before=said)
            self._news.notify()

    def close(self) -> None:
        """Wait until the last state is on the disk."""
        with self._news:
            self._is_over = True
            self._news.notify()
        self._thread.join()

    def _write_all(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._next is not None or self._is_over)
                kept, self._next = self._next, None
            if kept is None:
                return
            try:
                self.sync_before()
                SESSION_FILE.write(self.path, kept)
                self.why = ""
            except ExogravError as error:
                self.why = str(error)


def run_path(folder: Path, protocol: str, participant: str | None, session: int, windows: int | None = None) -> Path:
    """Path of the checkpoint of a run. A trial of the first windows has another file, so that it blocks no session."""
    return checkpoint_path(folder, session_name(participant, protocol, session, windows), is_simulated=False)


def kept_run(
    folder: Path,
    protocol: str | None,
    participant: str | None,
    session: int,
    rig: str,
    resumes: bool,
    is_restart: bool = False,
    part: OptionRecord | None = None,
) -> RunCheckpoint | None:
    """Checkpoint of this protocol, person and session; None if only the machine is steered.

    With `is_restart` the run is resumed if there is one, and begun otherwise. `part` holds further options that must be
    the same when the run is resumed: `windows` of a trial, and the hash `allocation`.

    Raises:
        ConfigError: As `RunCheckpoint`, or `--resume` is given without a protocol.
    """
    if protocol is None:
        if resumes:
            raise ConfigError("--resume needs --protocol: only the run of a protocol can be resumed.")
        return None
    if not 1 <= session <= SESSIONS_MAX:
        raise ConfigError(f"--session is {session}; allowed: 1 to {SESSIONS_MAX}.")
    folder.mkdir(parents=True, exist_ok=True)
    windows = None if part is None else part.get("windows")
    path = run_path(folder, protocol, participant, session, windows if isinstance(windows, int) else None)
    options: OptionRecord = {"protocol": protocol, "participant": participant, "session": session, "rig": rig}
    options |= part or {}
    return RunCheckpoint(path, options, path.exists() if is_restart else resumes)
