"""A virtual person in a virtual machine, and what the software is told about both."""

from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, Side, load_rig
from exograv.model.support import assemble
from exograv.model.wearer_form import WearerForm
from exograv.rig.twin import (
    Disturbances,
    Machine,
    Wearer,
    WearerModel,
    donned_again,
    draw_machine,
    draw_wearer,
    read_wearer_model,
)


@dataclass(frozen=True)
class VirtualLaboratory:
    """One machine and one wearer, drawn from a seed; only the twin and its examiner look inside."""

    description: RigDescription
    machine: Machine
    wearer: Wearer
    wearer_model: WearerModel | None = None
    """Whose arm it is where a third party's model is the truth."""

    @property
    def body(self) -> Body:
        """What somebody with a scale and a tape tells the software."""
        told = self.wearer.body
        return Body(told.height, told.mass, told.sex, dict(self.wearer.lengths_given))

    @property
    def form(self) -> WearerForm:
        """Body data and lengths, as an operator measures them."""
        return WearerForm(self.body, dict(self.wearer.lengths_given))

    def assembly(self) -> Assembly:
        """The machine with the arm of the table in it."""
        return assemble(self.description, self.body)


def draw_laboratory(
    rig: str,
    side: Side | None,
    level: int,
    seed: int,
    wearer_model: str | None = None,
    wearer_map: str | None = None,
    donning: int = 0,
) -> VirtualLaboratory:
    """Machine and wearer of this seed, at a disturbance level of 0 to 4.

    Args:
        rig: Name or folder of the machine.
        side: Arm; the machine's first where absent.
        level: Of all disturbances.
        seed: Draws machine and wearer.
        wearer_model: MJCF or URDF of an arm that is the truth in place of a drawn one (docs/wearer_models.md).
        wearer_map: What its bodies and joints are.
        donning: Number of the day on which this wearer is in this machine, 0 the first.

    Raises:
        ConfigError: A file cannot be read or used, or one of model and map is missing.
        ModelError: The model is no arm that the machine moves.
    """
    description = load_rig(rig, side)
    disturbances = Disturbances.at_level(level)
    machine = draw_machine(description, disturbances, seed)
    if wearer_model is None and wearer_map is None:
        wearer = draw_wearer(disturbances, seed, description.side, kind=description.settings.wearer.arm)
        return VirtualLaboratory(description, machine, donned_again(wearer, disturbances, seed, donning))
    if wearer_model is None or wearer_map is None:
        missing = "--wearer-model" if wearer_model is None else "--wearer-map"
        raise ConfigError(f"{missing} is missing: a wearer's model and its map go together (docs/wearer_models.md).")
    foreign = read_wearer_model(Path(wearer_model), Path(wearer_map), description)
    wearer = draw_wearer(disturbances, seed, foreign.skeleton.side, foreign.body, skeleton=foreign.skeleton)
    return VirtualLaboratory(description, machine, donned_again(wearer, disturbances, seed, donning), foreign)


PASSIVE_RIG, ACTIVE_RIG = "recupera_like_passive", "recupera_like"
