"""Virtual wearer in a virtual machine, and the data about both that the controller receives."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.loop.machine_limits import refuse_motorless
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, load_rig
from exograv.model.support import assemble
from exograv.model.wearer_form import WearerForm
from exograv.options import Side, TwinName, WorldName
from exograv.rig.twin import (
    Disturbances,
    Machine,
    Twin,
    Wearer,
    WearerModel,
    donned_again,
    draw_machine,
    draw_wearer,
    read_wearer_model,
)
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics, worn_inertia
from exograv.rig.twin.foreign_arm.wearer_model import MAP_MISSING
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.storage.calibration_file import twin_identity
from exograv.storage.twin_file import read_twin

from .fitted_machine import fitted_cuffs, fitted_identity, fitted_machine


@dataclass(frozen=True)
class VirtualLaboratory:
    """Machine and wearer, drawn from a seed. Only the twin and its examiner may read their truth."""

    description: RigDescription
    machine: Machine
    wearer: Wearer
    wearer_model: WearerModel | None = None
    """Third party's model of the arm, if it serves as the truth."""
    serial: str = ""
    """Serial number of the machine, which identifies its stored calibration."""
    world: WorldName = "home"
    """World whose laws act on machine and wearer."""

    @property
    def body(self) -> Body:
        """Body data as an operator measures them with a scale and a tape."""
        told = self.wearer.body
        return Body(told.height, told.mass, told.sex, dict(self.wearer.lengths_given))

    @property
    def form(self) -> WearerForm:
        """Body data and lengths, as an operator measures them."""
        return WearerForm(self.body, dict(self.wearer.lengths_given))

    def assembly(self) -> Assembly:
        """Assemble the machine with the arm of the anthropometric table."""
        return assemble(self.description, self.body)

    def twin(
        self,
        seed: int,
        t0: float = 0.0,
        start_posture: Float[np.ndarray, " joint"] | None = None,
        surroundings: Surroundings | None = None,
    ) -> Twin:
        """Put the wearer into the machine.

        Args:
            seed: Seed of the run: noise and muscles.
            t0: Time on the rig's clock [s].
            start_posture: Posture of the machine's joints [rad]; the donning posture if absent.
            surroundings: Objects that the hand can touch; an empty room if absent.
        """
        return Twin(self.description, self.machine, self.wearer, seed, start_posture, t0, surroundings=surroundings)

    def own_arm(self) -> ArmInverseDynamics:
        """Return the wearer's knowledge of the own arm."""
        return ArmInverseDynamics(self.description, self.machine, self.wearer)

    def worn_inertia(self) -> Float[np.ndarray, "arm arm"]:
        """Inertia of the machine about the arm's freedoms [kg·m²]."""
        return worn_inertia(self.description, self.machine, self.wearer)


def driven_laboratory(
    rig: str, side: Side | None, level: int, seed: int, world: WorldName = "home"
) -> VirtualLaboratory:
    """Draw machine and wearer of this seed; a machine with joints that have no motor is rejected.

    Raises:
        ConfigError: The machine cannot be read, or has joints without a motor.
    """
    laboratory = draw_laboratory(rig, side, level, seed, world=world)
    refuse_motorless(laboratory.description)
    return laboratory


def draw_laboratory(
    rig: str,
    side: Side | None,
    level: int,
    seed: int,
    wearer_model: str | None = None,
    wearer_map: str | None = None,
    donning: int = 0,
    world: WorldName = "home",
) -> VirtualLaboratory:
    """Draw machine and wearer of this seed, at a disturbance level of 0 to 4.

    Args:
        rig: Name or folder of the machine.
        side: Side of the arm; the machine's first side if absent.
        level: Level of all disturbances.
        seed: Seed of machine and wearer.
        wearer_model: Model of an arm that replaces the drawn one as the truth (docs/howto/wearer_models.md).
        wearer_map: Assignment of the model's bodies and joints; the names of an OpenSim model can stand for it.
        donning: Number of the day on which this wearer is in this machine, 0 for the first.
        world: World whose laws act.

    Raises:
        ConfigError: A file cannot be read or is not valid, or only one of model and map is given.
        ModelError: The model is not an arm that the machine can move.
    """
    description, disturbances = load_rig(rig, side), Disturbances.at_level(level, world)
    foreign = None
    if wearer_model is not None:
        foreign = read_wearer_model(Path(wearer_model), Path(wearer_map) if wearer_map else None, description)
    elif wearer_map is not None:
        raise ConfigError(MAP_MISSING.format(missing="--wearer-model"))
    drawn = laboratory_at(description, disturbances, seed, seed, foreign)
    wearer = donned_again(drawn.wearer, disturbances, seed, donning)
    return VirtualLaboratory(description, drawn.machine, wearer, foreign, twin_identity(level, seed, world), world)


def laboratory_at(
    description: RigDescription,
    disturbances: Disturbances,
    machine_seed: int,
    wearer_seed: int,
    foreign: WearerModel | None = None,
) -> VirtualLaboratory:
    """Draw a machine and a wearer with these disturbances; the wearer's arm is a `foreign` model's if one is given."""
    machine = draw_machine(description, disturbances, machine_seed)
    if foreign is None:
        kind = description.settings.wearer.arm
        wearer = draw_wearer(disturbances, wearer_seed, description.side, kind=kind)
    else:
        skeleton = foreign.skeleton
        wearer = draw_wearer(disturbances, wearer_seed, skeleton.side, foreign.body, skeleton=skeleton)
    return VirtualLaboratory(description, machine, wearer, foreign, world=disturbances.world)


def machine_of(description: RigDescription, disturbances: Disturbances, seed: int, twin: TwinName) -> Machine:
    """Draw a machine: from usual values of its kind, or from the posterior of its fitted twin.

    Raises:
        ConfigError: The machine has no fitted twin, and `twin` asks for it.
    """
    if twin == "drawn":
        return draw_machine(description, disturbances, seed)
    return fitted_machine(description, read_twin(description), disturbances, seed)


def with_twin(
    laboratory: VirtualLaboratory, twin: TwinName, disturbances: Disturbances, seed: int
) -> VirtualLaboratory:
    """Return the laboratory with the machine of this twin, and its cuffs if it has them; the wearer stays.

    Raises:
        ConfigError: The machine has no fitted twin, and `twin` asks for it.
    """
    if twin == "drawn":
        return laboratory
    whole = read_twin(laboratory.description)
    machine = fitted_machine(laboratory.description, whole, disturbances, seed)
    wearer = laboratory.wearer
    if whole.cuffs:
        cuffs = fitted_cuffs(laboratory.description, whole, disturbances, wearer.cuffs, seed)
        wearer = replace(wearer, cuffs=cuffs)
    return replace(laboratory, machine=machine, wearer=wearer, serial=fitted_identity(whole, seed))
