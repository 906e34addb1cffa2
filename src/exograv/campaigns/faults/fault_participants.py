"""Participants of a fault campaign: each is calibrated and identified once, by one process, for all processes."""

import pickle
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.laboratory.preparation import prepare
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory, with_twin
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress
from exograv.options import TwinName, WorldName
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Disturbances, parameter_truth

from .fault_plant import FaultParticipant

STRANGERS, STRANGER_SEEDS = 8, 100
"""Number of other persons whose files may be taken by mistake, and the spacing of their seeds [-]."""

RIGS = ("recupera_like", "recupera_like_qdd")
"""Machines of the participants by turns, unless the campaign names one."""


def prepare_participant(
    seed: int,
    person: int,
    level: int,
    folder: Path,
    progress: Progress = lambda *_: None,
    world: WorldName = "home",
    rig: str | None = None,
    twin: TwinName = "drawn",
) -> Path:
    """Calibrate and identify a participant as in any session; write the result to a file in `folder`.

    Args:
        seed: Seed of the campaign.
        person: Number of the participant.
        level: Level of the disturbances.
        folder: Folder of the file.
        progress: Callback with a sentence and the finished share [-].
        world: World whose laws act.
        rig: Machine of all participants; one of `RIGS` by turns if None.
        twin: Origin of the machine.

    Raises:
        ExogravError: The machine or the person could not be prepared.
    """
    drawn = 1000 * (seed + 1) + person
    name = RIGS[person % len(RIGS)] if rig is None else rig
    laboratory = draw_laboratory(name, None, level, drawn, world=world)
    laboratory = with_twin(laboratory, twin, Disturbances.at_level(level, world), drawn)
    prepared = prepare(laboratory, drawn, progress)
    of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    others = [STRANGER_SEEDS * (drawn + 1) + k for k in range(STRANGERS)]
    strangers = [arm_of(draw_laboratory(name, None, level, other), prepared) for other in others]
    path = folder / f"person_{person}.pickle"
    path.write_bytes(pickle.dumps((laboratory, prepared, of_person, np.array(strangers))))
    return path


def arm_of(laboratory: VirtualLaboratory, prepared: ControllerKnowledge) -> Float[np.ndarray, " phi"]:
    """Return the true inertial parameters of a laboratory's wearer, in the order of this controller's parameters."""
    truth, assembly = parameter_truth(laboratory.wearer), prepared.assembly
    names = [name for name, _ in parameters.names_and_units(assembly)]
    return np.array([truth[name] for name in names[parameters.ParameterLayout.of(assembly).phi]])


@lru_cache(maxsize=4)
def load_participant(path: Path, period_ms: int = 1) -> FaultParticipant:
    """Load the participant of this file, for a control period in ms; cached for the next scenario."""
    laboratory, prepared, of_person, strangers = pickle.loads(path.read_bytes())
    controller = ArmController(prepared.assembly, prepared.machine, prepared.x, 1e-3 * period_ms)
    return FaultParticipant(laboratory, prepared, controller, limits(laboratory.description), of_person, strangers)
