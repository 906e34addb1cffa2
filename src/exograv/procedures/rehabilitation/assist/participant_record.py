"""Record of a participant's sessions: each block and decision, and the file from which the next session starts."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings
from exograv.options import OptionRecord
from exograv.storage.checkpoint import Advice, StateFile
from exograv.task.assist_as_needed import AssistState, first_session, next_session
from exograv.task.assist_protocol import AssistProtocol, LoadedAssist

Percent = Annotated[float, Field(ge=0.0, le=100.0)]


class AssistBlock(Settings):
    """Attempts with one support level, and the decision after them."""

    support_percent: Percent
    reached: tuple[bool, ...]
    sank: bool
    code: str
    """Code of the decision's sentence (`task.assist_as_needed.SENTENCES`)."""

    gaps: dict[str, int | float]
    """Values for the placeholders of the sentence."""

    after_percent: Percent
    has_failed: bool


class AssistSession(Settings):
    """Session of one day."""

    number: Annotated[int, Field(ge=1)]
    protocol: AssistProtocol
    protocol_sha256: str
    began_percent: Percent
    blocks: tuple[AssistBlock, ...] = ()
    is_over: bool = False

    @property
    def state(self) -> AssistState:
        """State of the person after the last block."""
        if not self.blocks:
            return AssistState(self.began_percent, self.began_percent)
        last = self.blocks[-1]
        return AssistState(last.after_percent, self.began_percent, last.has_failed)


class AssistFile(Settings):
    """File of one participant's sessions."""

    schema_version: Literal[1] = 1
    participant: str
    options: OptionRecord
    sessions: tuple[AssistSession, ...] = ()

    def with_session(self, session: AssistSession) -> "AssistFile":
        """Return a copy of the file with the present state of this session."""
        others = tuple(one for one in self.sessions if one.number != session.number)
        return self.model_copy(update={"sessions": (*others, session)})


def opened(file: AssistFile, loaded: LoadedAssist, needed_percent: float | None, new_session: bool) -> AssistSession:
    """Return the session to be flown: the interrupted one, or the next.

    Raises:
        ConfigError: The session was interrupted under another protocol, or the needed support is given after the first
            session.
    """
    last, rule = file.sessions[-1] if file.sessions else None, loaded.settings.rule
    fresh = {"protocol": loaded.settings, "protocol_sha256": loaded.sha256}
    if last is None:
        return AssistSession(number=1, began_percent=first_session(rule, needed_percent).began_percent, **fresh)
    if needed_percent is not None:
        raise ConfigError(
            f"--needed-percent is for the first session; {file.participant} has {len(file.sessions)} already, and the "
            "next session continues the last. Leave it out."
        )
    if last.is_over or new_session:
        begin = next_session(rule, last.state).state.began_percent
        return AssistSession(number=last.number + 1, began_percent=begin, **fresh)
    if last.protocol_sha256 != loaded.sha256:
        raise ConfigError(
            f"Session {last.number} of {file.participant} was interrupted under another protocol file "
            f"('{last.protocol.name}'). Give the same file, or start another session with --new-session."
        )
    return last


ASSIST_FILE = StateFile[AssistFile](
    pack=lambda file: file.model_dump_json(indent=1) + "\n",
    unpack=AssistFile.model_validate_json,
    advice=Advice(
        too_large="{path} has more than {most} bytes, so it is not a file of sessions. Give another --out.",
        damaged="{path} is damaged: {why} Restore it from a copy, or move it away to start again.",
        other="--{name} is {value}, and the sessions in {path} were flown with {found}. Give the same, or another "
        "--participant.",
    ),
)


def read_assist(path: Path, participant: str, options: OptionRecord) -> AssistFile:
    """Return the sessions of this participant; an empty record if there is no file.

    Raises:
        ConfigError: The file cannot be read, is damaged, or is of another participant or virtual person.
    """
    file = ASSIST_FILE.find(path)
    if file is None:
        return AssistFile(participant=participant, options=options)
    if file.participant != participant:
        raise ConfigError(f"{path} belongs to {file.participant}, not to {participant}. Give another --out.")
    # An option that only the file has, such as `drives`, is refused, too.
    ASSIST_FILE.refuse_other(path, file.options, {**dict.fromkeys(file.options), **options})
    return file
