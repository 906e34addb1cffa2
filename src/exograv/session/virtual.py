"""A virtual person in a virtual machine, and what the software is told about both."""

from dataclasses import dataclass

import numpy as np

from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, Side, load_rig
from exograv.model.support import assemble
from exograv.rig.twin import Disturbances, Machine, Wearer, draw_machine, draw_wearer
from exograv.safety.envelope import Limits

# Soft descent: damping at the shoulder and at the elbow (docs/safety.md, SS1).
DAMPING_SHOULDER, DAMPING_ELBOW = 10.0, 4.0  # N·m·s/rad


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


def draw_laboratory(rig: str, side: Side, level: int, seed: int) -> VirtualLaboratory:
    """Machine and wearer of this seed, at a disturbance level of 0 to 4."""
    description = load_rig(rig, side)
    disturbances = Disturbances.at_level(level)
    return VirtualLaboratory(
        description, draw_machine(description, disturbances, seed), draw_wearer(disturbances, seed, side)
    )


def limits(description: RigDescription) -> Limits:
    """The envelope of this machine."""
    is_elbow = np.array(["elbow" in joint for joint in description.joints])
    return Limits(description.per_actuator("torque_max_Nm"), np.where(is_elbow, DAMPING_ELBOW, DAMPING_SHOULDER))
