"""A virtual person in a virtual machine, and what the software is told about both."""

from dataclasses import dataclass

import numpy as np

from exograv.errors import ConfigError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, Side, load_rig
from exograv.model.support import assemble
from exograv.rig.twin import Disturbances, Machine, Wearer, draw_machine, draw_wearer
from exograv.safety.envelope import Limits

DAMPING = {"shoulder": 10.0, "elbow": 4.0, "wrist": 0.4}
"""Of the soft descent [N·m·s/rad] (docs/safety.md, SS1); the wrist's is assumed, by the elbow's and their moments of
inertia."""


@dataclass(frozen=True)
class VirtualLaboratory:
    """One machine and one wearer, drawn from a seed; only the twin and its examiner look inside."""

    description: RigDescription
    machine: Machine
    wearer: Wearer

    @property
    def body(self) -> Body:
        """What somebody with a scale and a tape tells the software."""
        told = self.wearer.body
        return Body(told.height, told.mass, told.sex, dict(self.wearer.lengths_given))

    def assembly(self) -> Assembly:
        """The machine with the arm of the table in it."""
        return assemble(self.description, self.body)


def draw_laboratory(rig: str, side: Side | None, level: int, seed: int) -> VirtualLaboratory:
    """Machine and wearer of this seed, at a disturbance level of 0 to 4."""
    description = load_rig(rig, side)
    disturbances = Disturbances.at_level(level)
    return VirtualLaboratory(
        description,
        draw_machine(description, disturbances, seed),
        draw_wearer(disturbances, seed, description.side, kind=description.settings.wearer.arm),
    )


def refuse_motorless(description: RigDescription) -> None:
    """A machine that is to carry an arm needs a motor at every joint.

    Raises:
        ConfigError: Names the joints without one.
    """
    if description.motorless:
        raise ConfigError(
            f"{description.name} has no motor at {', '.join(description.motorless)}: it measures how an arm moves and "
            "cannot carry it. Choose a machine with motors (exograv rigs)."
        )


def limits(description: RigDescription) -> Limits:
    """The envelope of this machine."""
    damping = np.array([DAMPING[place] for place in description.places])
    return Limits(description.per_actuator("torque_max_Nm"), damping)
