"""Setup of a session for each condition of a virtual study: twin, controller and surroundings before the first tick.

`TrainingKnowledge` keeps the result of an identification, which all days of one participant in one condition share.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.control.tick import ControlMode
from exograv.dynamics.actuator import ActuatorGain
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.preparation import Preparation, unit_gains
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller, NoTorque
from exograv.loop.pilot import Progress
from exograv.model.description import PASSIVE_RIG
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Machine, Twin, day_seed
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics, out_of_the_machine
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.rig.twin.world.water import Water
from exograv.task.protocol import load_protocol
from exograv.task.protocol_schema import ExoMode

from .conditions import Condition

READY_S = 420.0
"""Time on the rig's clock at which a machine with known truth has warmed up, as after a calibration [s]."""


@dataclass
class SessionSetup:
    """Participant at a screen, before the first tick."""

    laboratory: VirtualLaboratory
    twin: Twin
    """Twin with screen and arm support, in the donning posture."""

    controller: Controller
    """Controller of the machine. If it carries an arm, the gravity level is 1."""

    actuators: ActuatorGain
    own: ArmInverseDynamics
    worn_inertia: Float[np.ndarray, "arm arm"]
    """Inertia of the machine about the arm's freedoms; zero where none is worn [kg·m²]."""

    surroundings: Surroundings
    exo: ExoMode
    left_over_Nm: float | None
    """Left over at the worst shoulder axis, RMS over the held-out postures [N·m]. It includes weight that the
    controller deliberately does not carry. None without motors."""

    friction_Nm: float | None
    """True Coulomb friction of the machine, mean over its joints [N·m]; None if none is worn."""


@dataclass(frozen=True)
class TrainingKnowledge:
    """Calibration and identification of one participant in one condition; can be pickled."""

    condition: Condition
    seed: int
    level: int
    known: ControllerKnowledge | None
    """Controller's knowledge of machine and arm; None if the condition has no motors."""

    left_over_Nm: float | None
    friction_Nm: float | None


def prepare_training(condition: Condition, seed: int, level: int, progress: Progress) -> TrainingKnowledge:
    """Calibrate and identify as the condition requires; takes half a minute where an arm is identified.

    Raises:
        ExogravError: Machine, wearer or run was refused.
    """
    if not condition.has_motors:
        return TrainingKnowledge(condition, seed, level, None, None, None)
    laboratory = _laboratory(condition, seed, level)
    known = _known(condition, laboratory, seed, progress)
    progress("Examining what is left over", 0.0)
    examination = Examination(laboratory, known.assembly, known.machine)
    left_over = examination.left_over(known.x, ControlMode(arm_share=_arm_share(condition)))
    places = np.array(laboratory.description.places)
    worst = float(left_over[places == "shoulder"].max())
    return TrainingKnowledge(condition, seed, level, known, worst, float(laboratory.machine.friction.coulomb.mean()))


_last = dict[tuple[Condition, int, int], TrainingKnowledge]()
"""Last result of this process. A sweep over a participant's constants uses one machine many times."""


def cached_training(condition: Condition, seed: int, level: int, progress: Progress) -> TrainingKnowledge:
    """Prepare as `prepare_training`, or return the last result if the arguments are the same.

    Raises:
        ExogravError: Machine, wearer or run was refused.
    """
    asked = condition, seed, level
    if asked not in _last:
        found = prepare_training(condition, seed, level, progress)
        _last.clear()
        _last[asked] = found
    return _last[asked]


def training_setup(prepared: TrainingKnowledge, day: int) -> SessionSetup:
    """Set up the training of this day, 0 the first; only noise and muscles differ between days."""
    condition, seed, level = prepared.condition, prepared.seed, prepared.level
    known = prepared.known
    if condition.training == "water":
        return _alone(seed, level, day, Water())
    if known is None:
        return flight_setup(seed, level, day)
    laboratory = _laboratory(condition, seed, level)
    surroundings = _surroundings(laboratory)
    twin = _twin(laboratory, surroundings, seed, day, known.t)
    controller = ArmController(known.assembly, known.machine, known.x, twin.period_s)
    controller.mode.gravity_level, controller.mode.arm_share = 1.0, _arm_share(condition)
    return _worn(
        laboratory, twin, controller, known.machine.actuators, surroundings, "active", prepared.left_over_Nm
    )  # fmt: skip


def prepared_setup(condition: Condition, seed: int, level: int, day: int, progress: Progress) -> SessionSetup:
    """Prepare the training and set it up for a single day.

    Raises:
        ExogravError: Machine, wearer or run was refused.
    """
    return training_setup(prepare_training(condition, seed, level, progress), day)


def familiarisation_setup(seed: int, level: int, day: int) -> SessionSetup:
    """Set up the same participant in the passive machine, which hangs on the arm with all its weight."""
    laboratory = draw_laboratory(PASSIVE_RIG, None, level, seed)
    surroundings, n = _surroundings(laboratory), len(laboratory.description.joints)
    twin = _twin(laboratory, surroundings, seed, day, 0.0)
    return _worn(laboratory, twin, NoTorque(n), unit_gains(n), surroundings, "passive", None)


def flight_setup(seed: int, level: int, day: int) -> SessionSetup:
    """Set up a flight in the passive machine. It begins at normal gravity; the caller changes gravity by `Twin.fly`."""
    return familiarisation_setup(seed, level, day)


def free_setup(seed: int, level: int, day: int, gravity_level: float) -> SessionSetup:
    """Set up the same participant without a machine, at a gravity of `gravity_level` g."""
    stage = _alone(seed, level, day, None)
    stage.twin.fly(np.array([0.0, 0.0, gravity_level]))
    return stage


def _alone(seed: int, level: int, day: int, water: Water | None) -> SessionSetup:
    """Set up a participant beside the machine: the cuffs are open, and machine and arm do not touch."""
    worn = draw_laboratory(PASSIVE_RIG, None, level, seed)
    laboratory = replace(worn, wearer=out_of_the_machine(worn.wearer))
    surroundings = replace(_surroundings(worn), water=water)
    twin, n = _twin(laboratory, surroundings, seed, day, 0.0), len(laboratory.description.joints)
    own = laboratory.own_arm()
    freedoms = len(twin.truth.q_arm)
    return SessionSetup(
        laboratory, twin, NoTorque(n), unit_gains(n), own, np.zeros((freedoms, freedoms)), surroundings, "passive",
        left_over_Nm=None, friction_Nm=None,
    )  # fmt: skip


def _worn(
    laboratory: VirtualLaboratory,
    twin: Twin,
    controller: Controller,
    actuators: ActuatorGain,
    surroundings: Surroundings,
    exo: ExoMode,
    left_over_Nm: float | None,
) -> SessionSetup:
    return SessionSetup(
        laboratory, twin, controller, actuators, laboratory.own_arm(), laboratory.worn_inertia(), surroundings, exo,
        left_over_Nm, float(laboratory.machine.friction.coulomb.mean()),
    )  # fmt: skip


def _known(condition: Condition, laboratory: VirtualLaboratory, seed: int, progress: Progress) -> ControllerKnowledge:
    if condition.training == "ideal":
        return ideal_knowledge(laboratory, READY_S)
    preparation = Preparation(laboratory, seed, progress)
    if condition.training in ("table", "gcm"):
        return preparation.calibrated()
    return preparation.identified("gradient" if condition.training == "gradient" else "recursive")


def _laboratory(condition: Condition, seed: int, level: int) -> VirtualLaboratory:
    laboratory = draw_laboratory(condition.rig, None, level, seed)
    return replace(laboratory, machine=scaled_friction(laboratory.machine, condition.friction))


def scaled_friction(machine: Machine, factor: float) -> Machine:
    """Scale the friction of a machine. Breakaway is a ratio to sliding friction, so it scales with it."""
    friction = machine.friction
    scaled = {name: factor * getattr(friction, name) for name in ("coulomb", "viscous", "load_share", "ripple")}
    return replace(machine, friction=replace(friction, **scaled))


def _arm_share(condition: Condition) -> float:
    return 0.0 if condition.training == "gcm" else 1.0 - condition.left


def _surroundings(laboratory: VirtualLaboratory) -> Surroundings:
    return SimulatedRoom().around(laboratory.assembly(), load_protocol("training").settings.target)


def _twin(laboratory: VirtualLaboratory, surroundings: Surroundings, seed: int, day: int, t: float) -> Twin:
    return laboratory.twin(day_seed(seed, day), t, surroundings=surroundings)
