"""Weak participant in a machine that carries the whole identified arm: the start of a support test."""

from dataclasses import dataclass, replace

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.preparation import Preparation, prepare
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, driven_laboratory
from exograv.loop.pilot import Progress
from exograv.model.assembly import read_exoskeleton
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording import RecordingWriter
from exograv.rig.twin.behaviour.weakness import Weakness, weakened

from .flight import SupportFlight
from .options import SupportOptions
from .person_file import weakness_of
from .weak_person import BodyKnowledge, ReachingPerson

LIMIT_MARGIN = np.deg2rad(5.0)
"""Margin to the joint limits [rad]: a limb in soft cuffs is not exactly at the machine's angles."""


@dataclass(frozen=True)
class WeakParticipant:
    """Machine, weak wearer, and the controller's knowledge of both."""

    laboratory: VirtualLaboratory
    weakness: Weakness
    body: BodyKnowledge
    known: ControllerKnowledge
    seed: int

    def flight(self, run_seed: int, recording: RecordingWriter | None = None) -> SupportFlight:
        """Start a test. `run_seed` draws its noise.

        Raises:
            RigError: The envelope stopped the motion to rest.
        """
        worn = Preparation(self.laboratory, run_seed, recording=recording).worn(self.known)
        worn.limit_to_person()
        person = ReachingPerson(self.body, self.weakness, worn.twin, run_seed)
        return SupportFlight(worn.pilot, worn.controller, person, self.laboratory.wearer.arms[0].side)


def prepare_weak_participant(options: SupportOptions, progress: Progress) -> WeakParticipant:
    """Draw and calibrate the machine, and identify the arm.

    Raises:
        ConfigError: An option, a file or the machine is not valid.
        ExogravError: The machine, the wearer or the run was refused.
    """
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    description = laboratory.description
    if len(description.joints) != 4 or len(laboratory.wearer.arms) != 1 or description.settings.donning.arm_posture_deg:
        raise ConfigError(
            f"{description.name} does not have the four joints of one arm, for which the targets are made. Choose "
            "recupera_like or recupera_like_qdd."
        )
    weakness = weakness_of(options, len(description.arm_donning_posture))
    laboratory = replace(laboratory, wearer=weakened(laboratory.wearer, weakness))
    lower, upper = np.array([(joint.lower, joint.upper) for joint in read_exoskeleton(description).joints]).T
    body = BodyKnowledge.of(laboratory, lower + LIMIT_MARGIN, upper - LIMIT_MARGIN)
    return WeakParticipant(laboratory, weakness, body, prepare(laboratory, options.seed, progress), options.seed)
