"""File of a person's arm for a command on drives: found by the code of the person, and written after the flight."""

from pathlib import Path

from exograv.errors import ConfigError
from exograv.live.learned_person import learned_person
from exograv.live.live_processes import LiveResult
from exograv.live.options import ParticipantChoice
from exograv.next_command import same_machine
from exograv.options import MachineOptions
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.options import NO_FILES, ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept, ParticipantRun
from exograv.storage.participant_file import read_participant, write_participant
from exograv.storage.session_readiness import keep_words, participants_in


def stored_arm(choice: ParticipantChoice, options: MachineOptions, folder: Path) -> ParticipantOptions:
    """Return the files of a chosen person whose arm is stored; without a choice none.

    Args:
        choice: Code of the person, and folder of the files.
        options: Machine of the command.
        folder: Folder of the machine's files.

    Raises:
        ConfigError: There is no file of this person, or it cannot be used.
    """
    code = choice.participant
    if code is None:
        return NO_FILES
    files = arm_of_session(code, choice.participants, folder)
    if files.participant is None:
        path = (choice.participants or participants_in(folder)) / f"{code}.toml"
        words = keep_words(path, code, options.simulate)
        raise ConfigError(
            f"There is no stored arm of {code}: {path} is missing. Identify the arm once and store it: "
            f"`{same_machine('arm identify', options, folder, words)}`. Or leave out --participant: this command then "
            "identifies the arm first and stores nothing."
        )
    return files


def arm_of_session(code: str, people: Path | None, folder: Path) -> ParticipantOptions:
    """Return the files of a session: it starts from the person's file if there is one, and writes it.

    Args:
        code: Code of the person.
        people: Folder of the participants' files; None for the usual one.
        folder: Folder of the machine's files.

    Raises:
        ConfigError: The file is damaged, or it is of another code.
    """
    files = ParticipantOptions.of_file((people or participants_in(folder)) / f"{code}.toml", code)
    if files.participant is not None:
        inside = read_participant(files.participant).person.code
        if inside != code:
            raise ConfigError(
                f"{files.participant} holds the arm of '{inside}', not of '{code}'. Give the file its own name again: "
                f"{inside}.toml."
            )
    return files


def keep_flown(
    person: ParticipantRun, prepared: ControllerKnowledge, flown: LiveResult
) -> KeptParticipant | NotKept | None:
    """Write the arm that a flight has shown; None if no file was requested, or the identification did not finish.

    Args:
        person: Files of the person.
        prepared: Machine with the arm in it.
        flown: Result of the flight.

    Raises:
        ConfigError: The file cannot be written.
    """
    learned, predicted, path = flown.learned, flown.predicted, person.options.keep
    if path is None or learned is None or predicted is None:
        return None
    whole = learned_person(person.code, person.told, prepared, person.serial, learned, predicted, person.before)
    if whole is None:
        return NotKept(None, f"Not kept. {learned.outcome.value}")
    write_participant(path, whole)
    return KeptParticipant.of(path, whole)
