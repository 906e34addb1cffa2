"""What is kept of a console's run beside its diary, so that another console goes on when this one was killed."""

import threading
from pathlib import Path

from exograv.errors import ConfigError, ExogravError
from exograv.model.rig_settings import Settings
from exograv.options import SESSIONS_MAX, OptionRecord, Side
from exograv.storage.session_checkpoint import SESSION_FILE, KeptSession, read_kept, refuse_kept
from exograv.task.screen import ScreenCalibration


class RunContext(Settings):
    """What a run was begun with, besides its protocol."""

    side: Side | None = None
    """Whose arm."""

    screen: ScreenCalibration | None = None


class RunCheckpoint:
    """The file of one run; written by a thread of its own, for a disk may take its time and pages may not wait."""

    def __init__(self, path: Path, options: OptionRecord, resumes: bool):
        """Nothing is written before the run begins.

        Args:
            path: Of the file.
            options: What has to be the same when it is gone on with.
            resumes: Whether the file is there, and gone on with.

        Raises:
            ConfigError: There is such a run and nobody goes on with it, or the other way round.
        """
        self.path, self._options = path, options
        self.before: KeptSession | None = None
        self.circumstances = RunContext()
        """As they were."""
        self.why = ""
        """What was wrong with the last writing; empty where nothing was."""

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
        """As it is now; where the disk is slow, the newest is written.

        Args:
            run: `Run.kept()`.
            t: On the desk's clock [s].
            circumstances: Of it.
        """
        said = circumstances.model_dump(mode="json")
        with self._news:
            self._next = KeptSession(options=self._options, t=t, run=run, person=None, before=said)
            self._news.notify()

    def close(self) -> None:
        """The last is on the disk."""
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
                SESSION_FILE.write(self.path, kept)
                self.why = ""
            except ExogravError as error:
                self.why = str(error)


def kept_run(
    folder: Path, protocol: str | None, participant: str | None, session: int, rig: str, resumes: bool
) -> RunCheckpoint | None:
    """Of this protocol, person and session; None where only the machine is steered.

    Raises:
        ConfigError: As `RunCheckpoint`; or there is no protocol to go on with.
    """
    if protocol is None:
        if resumes:
            raise ConfigError("--resume is given without --protocol: only the run of a protocol is gone on with.")
        return None
    if not 1 <= session <= SESSIONS_MAX:
        raise ConfigError(f"--session is {session}; allowed: 1 to {SESSIONS_MAX}.")
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{participant or 'console'}_{Path(protocol).stem}_{session:02d}.run.json"
    options: OptionRecord = {"protocol": protocol, "participant": participant, "session": session, "rig": rig}
    return RunCheckpoint(folder / name, options, resumes)
