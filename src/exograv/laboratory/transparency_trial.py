"""Muscle effort of one machine with one wearer: one preparation, then the same movement in six conditions."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.output_feedback import Controller, NoTorque
from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription
from exograv.options import TwinName, WorldName
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Disturbances
from exograv.rig.twin.behaviour.internal_model import in_gravity, out_of_the_machine

from .conditions import leave_the_arm, switch_off
from .effort import Effort, Note, Performer, WearerExperience
from .ideal_knowledge import ideal_knowledge
from .movements import WantedMovement
from .preparation import Preparation, prepare
from .virtual_laboratory import VirtualLaboratory, laboratory_at, with_twin

CONDITIONS: Mapping[str, str] = {
    "uncompensated": "motors off",
    "gcm": "machine carried",
    "dam": "machine and identified arm carried",
    "dam_ideal": "machine and arm carried, truth known",
    "dam_ideal_no_friction": "the same without friction",
    "zero_g": "weightless, without machine",
}
"""Description of each condition, by the name of the condition."""

UNREST = ("slow_bias", "bursts")
"""Disturbances that are off while effort is measured, because they are the wearer's and not the machine's.

    They are on during the identification.
"""

FRICTION = ("coulomb", "viscous", "load_friction", "friction_ripple")


@dataclass(frozen=True)
class TransparencyTrial:
    """Machine, wearer, and disturbance level."""

    description: RigDescription
    level: int
    seed: int
    world: WorldName = "home"
    twin: TwinName = "drawn"

    def laboratory(self, *off: str) -> VirtualLaboratory:
        """Draw the laboratory with the disturbances in `off` switched off. All others stay the same."""
        disturbances = Disturbances.at_level(self.level, self.world).without(*off)
        drawn = laboratory_at(self.description, disturbances, self.seed, self.seed)
        return with_twin(drawn, self.twin, disturbances, self.seed)


def run_trial(trial: TransparencyTrial, movement: WantedMovement, progress: Progress) -> dict[str, Effort]:
    """Measure the effort by condition.

    Raises:
        ExogravError: Calibration, identification or a run was refused or stopped.
    """
    parts = len(CONDITIONS) + 1
    known = prepare(trial.laboratory(), trial.seed, lambda text, _share: progress(text, 0.0))
    efforts = {}
    for k, (condition, words) in enumerate(CONDITIONS.items(), start=1):

        def note(share: float, k: int = k, words: str = words) -> None:
            progress(words, (k + share) / parts)

        efforts[condition] = _effort(trial, condition, known, movement, note)
    return efforts


def _effort(
    trial: TransparencyTrial, condition: str, known: ControllerKnowledge, movement: WantedMovement, note: Note
) -> Effort:
    if condition == "zero_g":
        return effort_alone(trial, movement, known.t, 0.0, note)
    laboratory = trial.laboratory(*UNREST, *(FRICTION if condition == "dam_ideal_no_friction" else ()))
    if condition.startswith("dam_ideal"):
        known = ideal_knowledge(laboratory, known.t)
    return worn_effort(Preparation(laboratory, trial.seed), condition, known, movement, note)


def worn_effort(
    preparation: Preparation, condition: str, known: ControllerKnowledge, movement: WantedMovement, note: Note
) -> Effort:
    """Measure the movement in a machine, in a condition other than `zero_g`; control uses this knowledge.

    Raises:
        ExogravError: The wearer or the run was refused or stopped.
    """
    laboratory = preparation.laboratory
    worn = preparation.worn(known)
    used_to = WearerExperience(laboratory.own_arm(), laboratory.worn_inertia())
    performer = Performer(worn.pilot, worn.twin, used_to, movement, note)
    carrying, dt = worn.controller, worn.twin.period_s
    performer.go_to_start(carrying)
    controller: Controller = carrying
    if condition == "gcm":
        controller = leave_the_arm(performer, carrying, dt)
    elif condition == "uncompensated":
        controller = switch_off(performer, carrying, dt)
    return performer.perform(controller, 0.0 if condition.startswith("dam") else 1.0)


def effort_alone(trial: TransparencyTrial, movement: WantedMovement, t: float, level: float, note: Note) -> Effort:
    """Measure the movement as in the aircraft: with this share of Earth's gravity [-], and without the machine."""
    worn = trial.laboratory(*UNREST)
    machine, wearer = in_gravity(worn.machine, level), out_of_the_machine(worn.wearer)
    alone = Preparation(replace(worn, machine=machine, wearer=wearer), trial.seed)
    twin, nominal = alone.laboratory.twin(trial.seed, t), trial.description.nominal_gain
    # No current flows, so the gains have no effect.
    pilot, controller = alone.pilot_of(twin, ActuatorGain(nominal, nominal)), NoTorque(len(twin.joints))
    n = movement.path.q.shape[1]
    performer = Performer(pilot, twin, WearerExperience(worn.own_arm(), np.zeros((n, n))), movement, note)
    performer.go_to_start(controller)
    return performer.perform(controller, level)
