"""Weak participant in a machine that carries the whole identified arm: the start of a support test."""

from dataclasses import dataclass, replace

import numpy as np

from exograv.laboratory.preparation import Preparation, prepare
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, driven_laboratory
from exograv.loop.floating_machine import PilotedMachine
from exograv.loop.pilot import Progress
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import ArmSide
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.rehabilitation.support_level.flight import SupportFlight
from exograv.procedures.rehabilitation.support_level.options import SupportOptions, WeakPersonOptions
from exograv.procedures.rehabilitation.support_level.targets import refuse_without_targets
from exograv.recording import RecordingWriter
from exograv.rig.twin.behaviour.weakness import Weakness, weakened

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

    @property
    def side(self) -> ArmSide:
        """Side of the arm."""
        return self.laboratory.wearer.arms[0].side

    def seated(self, run_seed: int, recording: RecordingWriter | None = None) -> tuple[PilotedMachine, ReachingPerson]:
        """Return the machine with the person in it. `run_seed` draws the noise of the run."""
        worn = Preparation(self.laboratory, run_seed, recording=recording).worn(self.known)
        worn.limit_to_person()
        person = ReachingPerson(self.body, self.weakness, worn.twin, run_seed)
        return PilotedMachine(worn.pilot, worn.controller, person.act), person

    def flight(self, run_seed: int, recording: RecordingWriter | None = None) -> SupportFlight:
        """Start a test. `run_seed` draws its noise.

        Raises:
            RigError: The envelope stopped the motion to rest.
        """
        return SupportFlight(*self.seated(run_seed, recording), self.side)


def prepare_weak_participant(options: SupportOptions, progress: Progress) -> WeakParticipant:
    """Draw and calibrate the machine, and identify the arm.

    Raises:
        ConfigError: An option, a file or the machine is not valid.
        ExogravError: The machine, the wearer or the run was refused.
    """
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    laboratory, weakness, body = weak_in(laboratory, options)
    return WeakParticipant(laboratory, weakness, body, prepare(laboratory, options.seed, progress), options.seed)


def weak_in(
    laboratory: VirtualLaboratory, options: WeakPersonOptions
) -> tuple[VirtualLaboratory, Weakness, BodyKnowledge]:
    """Give the wearer of a laboratory the strength of these options, and knowledge of the own arm.

    Raises:
        ConfigError: An option or a file is not valid, or the machine is not one for the targets.
    """
    description = laboratory.description
    refuse_without_targets(description)
    weakness = weakness_of(options, len(description.arm_donning_posture))
    laboratory = replace(laboratory, wearer=weakened(laboratory.wearer, weakness))
    lower, upper = np.array([(joint.lower, joint.upper) for joint in read_exoskeleton(description).joints]).T
    return laboratory, weakness, BodyKnowledge.of(laboratory, lower + LIMIT_MARGIN, upper - LIMIT_MARGIN)
