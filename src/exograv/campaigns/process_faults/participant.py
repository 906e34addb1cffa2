"""Participant of the process faults: calibrated and identified once, as a session knows the arm afterwards."""

import pickle
from dataclasses import dataclass, replace
from pathlib import Path

from exograv.campaigns.faults.fault_participants import prepare_participant
from exograv.live.live_identification import unknown_person
from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription
from exograv.model.wearer_form import WearerForm
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.safety.limits import PersonLimits

FILE = "participant.pickle"


@dataclass(frozen=True)
class PreparedParticipant:
    """Knowledge of a session about machine and arm. It holds nothing of the twin's truth."""

    description: RigDescription
    form: WearerForm
    prepared: ControllerKnowledge
    person: PersonLimits

    unknown: ControllerKnowledge
    """The same machine with the arm of the table, as before an identification."""

    anyone: PersonLimits
    """Limits for an unknown arm."""


def drawn_seed(seed: int) -> int:
    """Seed of laboratory and wearer that `prepare_participant` draws for the first participant of a campaign."""
    return 1000 * (seed + 1)


def participant_file(folder: Path, seed: int, level: int, progress: Progress, is_kept: bool) -> Path:
    """Return the file of the participant in `folder`; prepare the participant, unless the file exists and `is_kept`.

    Raises:
        ExogravError: The machine or the person could not be prepared.
    """
    path = folder / FILE
    if path.exists() and is_kept:
        return path
    folder.mkdir(parents=True, exist_ok=True)
    drawn = prepare_participant(seed, 0, level, folder, progress)
    laboratory, prepared, person, _ = pickle.loads(drawn.read_bytes())
    unknown = replace(prepared, x=table_guess(prepared.assembly, prepared.machine))
    anyone = unknown_person(prepared.assembly, prepared.machine)
    known = PreparedParticipant(laboratory.description, laboratory.form, prepared, person, unknown, anyone)
    drawn.unlink()
    path.write_bytes(pickle.dumps(known))
    return path
