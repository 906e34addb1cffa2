"""One machine with one wearer: prepared once, then the same movement in six conditions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Controller, Progress
from exograv.model.description import RigDescription
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.rig.twin.behaviour.own_arm import OwnArm, out_of_the_machine, weightless, worn_inertia

from .conditions import NoTorque, leave_the_arm, switch_off
from .effort import Effort, Note, Performer, UsedTo
from .ideal_from_truth import prepared_by_truth
from .movements import WantedMovement
from .preparation import pilot_of, prepare
from .virtual_laboratory import VirtualLaboratory

CONDITIONS: Mapping[str, str] = {
    "uncompensated": "motors off",
    "gcm": "machine carried",
    "dam": "machine and identified arm carried",
    "dam_ideal": "machine and arm carried, truth known",
    "dam_ideal_no_friction": "the same without friction",
    "zero_g": "weightless, without machine",
}
"""By the names of the contract, in words."""

UNREST = ("slow_bias", "bursts")
"""Off while effort is measured: they are the wearer's, not the machine's. Identification before has to bear them."""

FRICTION = ("coulomb", "viscous", "load_friction", "friction_ripple")


@dataclass(frozen=True)
class TransparencyTrial:
    """Which machine, which wearer, at which disturbance level."""

    description: RigDescription
    level: int
    seed: int

    def laboratory(self, *off: str) -> VirtualLaboratory:
        """Without the disturbances that are switched off; all others are as they were."""
        disturbances = Disturbances.at_level(self.level).without(*off)
        side, kind = self.description.side, self.description.settings.wearer.arm
        return VirtualLaboratory(
            self.description,
            draw_machine(self.description, disturbances, self.seed),
            draw_wearer(disturbances, self.seed, side, kind=kind),
        )


def run_trial(trial: TransparencyTrial, movement: WantedMovement, progress: Progress) -> dict[str, Effort]:
    """Effort by condition.

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
        return _effort_alone(trial, movement, known.t, note)
    laboratory = trial.laboratory(*UNREST, *(FRICTION if condition == "dam_ideal_no_friction" else ()))
    if condition.startswith("dam_ideal"):
        known = prepared_by_truth(laboratory, known.t)
    description, machine, wearer = laboratory.description, laboratory.machine, laboratory.wearer
    twin = Twin(description, machine, wearer, trial.seed, t0=known.t)
    pilot = pilot_of(twin, known.machine.actuators, laboratory, _silent)
    used_to = UsedTo(OwnArm(description, machine, wearer), worn_inertia(description, machine, wearer))
    performer = Performer(pilot, twin, used_to, movement, note)
    carrying = ArmController(known.assembly, known.machine, known.x, twin.period_s)
    performer.go_to_start(carrying)
    controller: Controller = carrying
    if condition == "gcm":
        controller = leave_the_arm(performer, carrying, twin.period_s)
    elif condition == "uncompensated":
        controller = switch_off(performer, carrying, twin.period_s)
    return performer.perform(controller, 0.0 if condition.startswith("dam") else 1.0)


def _effort_alone(trial: TransparencyTrial, movement: WantedMovement, t: float, note: Note) -> Effort:
    """As in the aircraft: nothing weighs, and the machine is not worn."""
    laboratory = trial.laboratory(*UNREST)
    description, machine, wearer = laboratory.description, laboratory.machine, laboratory.wearer
    twin = Twin(description, weightless(machine), out_of_the_machine(wearer), trial.seed, t0=t)
    actuators = ActuatorGain(description.nominal_gain, description.nominal_gain)  # no current will flow
    pilot, controller = pilot_of(twin, actuators, laboratory, _silent), NoTorque(len(twin.joints))
    own = OwnArm(description, machine, wearer)
    n = movement.path.q.shape[1]
    performer = Performer(pilot, twin, UsedTo(own, np.zeros((n, n))), movement, note)
    performer.go_to_start(controller)
    return performer.perform(controller, 0.0)


def _silent(_text: str, _share: float) -> None:
    """Progress is told by repetitions."""
