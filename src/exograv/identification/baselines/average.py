"""Average: two rigid bodies from an anthropometric table, scaled by height, weight and lengths; nothing is measured.

Four parameters: mass and distance of the centre of mass along the bone, for upper arm and forearm with hand. With a
wrist that moves the hand is a body of its own, with two more. The table is the one that every other method starts
from. Aligned shoulders, no passive torque.

Source: the method *Average* of Just et al. 2020, J NeuroEng Rehabil 17:13, doi 10.1186/s12984-020-0644-3; which table
was used there could not be read.
"""

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.model.assembly import Assembly

from .resting_correction import table_arm


class Average:
    """`Method` that never learns; it states no uncertainty."""

    name = "average"

    def __init__(self, table: Parameters):
        self._table, self._t = table.copy(), 0.0

    def update(self, sample: Sample) -> None:
        """Only the clock runs."""
        self._t = sample.t

    def estimate(self) -> Estimate:
        """The table."""
        return Estimate(self._t, self._table.copy(), None, 0.0, 1.0)


def average(assembly: Assembly, machine: CalibratedMachine) -> Average:
    """The method for this arm in this machine."""
    return Average(table_arm(assembly, machine))
