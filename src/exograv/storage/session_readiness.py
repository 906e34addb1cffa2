"""State of one person and one session in their files: arm, checkpoint and study, for the checklist of a machine."""

import shlex
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from exograv.errors import ExogravError
from exograv.next_command import same_machine
from exograv.options import SESSIONS_MAX
from exograv.task.protocol import LoadedProtocol, load_protocol
from exograv.task.state import RunState

from .calibration_file import identity_of, refuse_other_machine
from .machine_readiness import Check, MachineReadiness, age_text
from .participant_file import AGAIN, read_participant, refuted_text
from .session_checkpoint import SESSION_FILE, checkpoint_path, session_name

FORM = "--body-height M --body-mass KG --sex female"
"""Options of a form whose values the operator fills in."""


class SessionState(NamedTuple):
    """State of a session by its checkpoint."""

    number: int
    has_begun: bool
    is_over: bool
    text: str


@dataclass(frozen=True)
class SessionReadiness:
    """Person and session on one machine."""

    machine: MachineReadiness
    participant: str
    """Code of the person."""
    people: Path
    """Folder of the participants' files."""
    protocol: str
    session: int | None
    """Number of the session; None for the first that is not over."""
    study: Path | None = None

    def checks(self) -> list[Check]:
        """Return the rows of arm, study and session.

        Raises:
            ConfigError: The protocol cannot be used.
        """
        return [self.arm(), *([] if self.study is None else [self._of_study(self.study)]), self.of_session()]

    @property
    def file(self) -> Path:
        """File of the person's arm."""
        return self.people / f"{self.participant}.toml"

    def arm(self) -> Check:
        """Return the state of the person's arm."""
        machine, path = self.machine, self.file
        if not path.exists():
            return Check("arm", True, f"no file {path}: the session identifies the arm for 60 s.")
        try:
            whole = read_participant(path)
            refuse_other_machine(path, whole.machine, identity_of(machine.description, machine.serial), AGAIN)
        except ExogravError as error:
            words = keep_words(path, self.participant, machine.options.simulate)
            return Check("arm", False, str(error), same_machine("arm identify", machine.options, machine.folder, words))
        if warning := refuted_text(whole):
            return Check("arm", True, f"{warning} This takes 60 s.")
        found = whole.identified
        age, times = age_text(machine.now - found.at_utc), "once" if found.donnings == 1 else f"{found.donnings} times"
        return Check("arm", True, f"identified {times}, last {age} ago: the session checks it for 20 s.")

    def of_session(self) -> Check:
        """Return the state of the session, with the command that begins or resumes it.

        Raises:
            ConfigError: The protocol cannot be used.
        """
        loaded = load_protocol(self.protocol)
        try:
            state = self._state(loaded)
        except ExogravError as error:
            return Check("session", False, str(error), self._train(self._next_free()))
        begins = self._train(state.number, "--resume" if state.has_begun else "")
        return Check("session", True, state.text, self._train(state.number + 1) if state.is_over else begins)

    def _state(self, loaded: LoadedProtocol) -> SessionState:
        """Return the state of the session that was asked for, or of the first that is not over.

        Raises:
            ConfigError: A checkpoint is damaged.
        """
        numbers = range(1, SESSIONS_MAX + 1) if self.session is None else (self.session,)
        state = self._of_number(numbers[0], loaded)
        for number in numbers[1:]:
            if not state.is_over:
                break
            state = self._of_number(number, loaded)
        return state

    def _of_number(self, number: int, loaded: LoadedProtocol) -> SessionState:
        name, path = f"session {number} of '{self.protocol}'", self._checkpoint(number)
        if not path.exists():
            return SessionState(number, False, False, f"{name} has not begun.")
        state = RunState.model_validate_json(SESSION_FILE.read(path).run)
        done = f"{len(state.complete)} of {len(loaded.settings.windows.numbers)} windows are complete"
        if state.status in ("finished", "stopped"):
            return SessionState(number, True, True, f"{name} is over; {done}.")
        ago = age_text(self.machine.now - datetime.fromtimestamp(path.stat().st_mtime, self.machine.now.tzinfo))
        return SessionState(number, True, False, f"{name} was interrupted; {done}, the last state is {ago} old.")

    def _next_free(self) -> int:
        return next(n for n in range(1, SESSIONS_MAX + 1) if not self._checkpoint(n).exists())

    def _checkpoint(self, number: int) -> Path:
        name = session_name(self.participant, self.protocol, number)
        return checkpoint_path(self.machine.folder, name, is_simulated=False)

    def _train(self, number: int, more: str = "") -> str:
        machine = self.machine
        words = [f"--participant {self.participant}"]
        if self.people != participants_in(machine.folder):
            words.append(f"--participants {shlex.quote(str(self.people))}")
        if self.protocol != "training":
            words.append(f"--protocol {shlex.quote(self.protocol)}")
        if number != 1:
            words.append(f"--session {number}")
        # Simulated drives bring their own wearer with them, and a file has the form of a known person.
        if not (machine.options.simulate or self.file.exists()):
            words.append(FORM)
        return same_machine("run train", machine.options, machine.folder, " ".join(filter(None, (*words, more))))

    def _of_study(self, study: Path) -> Check:
        """Return the state of this person in a study."""
        # A computer with a machine only needs no packages of a study.
        from exograv.study.dataset.sources import placed_sources
        from exograv.study.folder.settings import read_settings
        from exograv.study.folder.study_folder import StudyFolder
        from exograv.study.participants.register import read_register

        try:
            folder = StudyFolder(study)
            settings = read_settings(folder)
            row = next((one for one in read_register(folder) if one.code == self.participant), None)
            keys = {(one.note.protocol, one.note.session) for one in placed_sources(folder)
                    if one.note.participant == self.participant}  # fmt: skip
        except ExogravError as error:
            return Check("study", False, str(error), f"exograv study status {shlex.quote(str(study))}")
        if row is None:
            add = f"exograv study participant {shlex.quote(str(study))} new {self.participant}"
            return Check("study", False, f"{self.participant} is not in the register of {study}.", add)
        expected = settings.expected_of(row.group)
        there = ", ".join(
            f"{sum(name == protocol for name, _ in keys)} of {count} sessions of '{protocol}'"
            for protocol, count in expected.items()
        )
        return Check("study", True, f"{there or len(keys)} are in {study}.")


def keep_words(path: Path, code: str, is_simulated: bool) -> str:
    """Return the options of `exograv arm identify` that store the arm. Simulated drives bring their own wearer."""
    words = ["--keep", shlex.quote(str(path)), "--code", code]
    return " ".join(words if is_simulated else [*words, FORM])


def participants_in(folder: Path) -> Path:
    """Return the usual folder of the participants' files in the folder of `--out`."""
    return folder / "participants"
