"""Average: two rigid bodies from an anthropometric table, scaled by height, weight and lengths, without measurement.

It has four parameters: mass and distance of the centre of mass along the bone, for upper arm and forearm with hand. If
the machine moves the wrist, the hand is a body of its own, with two more parameters. The table is the start of all
other methods too. Shoulders are aligned, and there is no passive torque.

Source: the method *Average* of Just et al. 2020, J NeuroEng Rehabil 17:13, doi 10.1186/s12984-020-0644-3. We
could not read which table was used there.
"""

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.model.assembly import Assembly

from .resting_correction import table_arm


class Average:
    """Method that does not learn; it states no uncertainty."""

    name = "average"

    def __init__(self, table: Parameters):
        self._table, self._t = table.copy(), 0.0

    def update(self, sample: Sample) -> None:
        """Advance the clock; the sample is not used."""
        self._t = sample.t

    def estimate(self) -> Estimate:
        """Return the table's arm."""
        return Estimate(self._t, self._table.copy(), None, 0.0, 1.0)


def average(assembly: Assembly, machine: CalibratedMachine) -> Average:
    """Build the method for this arm in this machine."""
    return Average(table_arm(assembly, machine))
