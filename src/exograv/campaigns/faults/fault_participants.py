"""Participants of a fault campaign: each is calibrated and identified once, by one process, for all processes."""

import pickle
from functools import lru_cache
from pathlib import Path

from exograv.laboratory.preparation import prepare
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress

from .fault_plant import FaultParticipant

RIGS = ("recupera_like", "recupera_like_qdd")
"""Machines of the participants, in turn."""


def prepare_participant(seed: int, person: int, level: int, folder: Path, progress: Progress = lambda *_: None) -> Path:
    """Calibrate and identify a participant as in any session; write the result to a file in `folder`.

    Raises:
        ExogravError: The machine or the person could not be prepared.
    """
    drawn = 1000 * (seed + 1) + person
    laboratory = draw_laboratory(RIGS[person % len(RIGS)], None, level, drawn)
    prepared = prepare(laboratory, drawn, progress)
    of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    path = folder / f"person_{person}.pickle"
    path.write_bytes(pickle.dumps((laboratory, prepared, of_person)))
    return path


@lru_cache(maxsize=4)
def load_participant(path: Path, period_ms: int = 1) -> FaultParticipant:
    """Load the participant of this file, for a control period in ms; cached for the next scenario."""
    laboratory, prepared, of_person = pickle.loads(path.read_bytes())
    controller = ArmController(prepared.assembly, prepared.machine, prepared.x, 1e-3 * period_ms)
    return FaultParticipant(laboratory, prepared, controller, limits(laboratory.description), of_person)
