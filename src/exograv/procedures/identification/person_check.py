"""Check that a file belongs to the wearer, by the evidence of the first seconds of motion for file or table."""

from dataclasses import dataclass, field

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.prior import disturbance_sd
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.recursive.prior_comparison import UnexplainedTorque, log_odds

from .estimator_session import Belief

JUDGED_S = (5.0, 10.0, 19.0)
"""Times of motion after which the samples are compared [s].

The last one must come before the end of `FROM_FILE_S`: the filter of the samples takes up to 0.3 s of the motion.
"""

ONE_IN = 4
"""Divisor of the sample rate: one in so many means over `BATCH_PERIOD_S` is compared [-]."""

CONTRADICTED = -5.0
"""Log evidence of the file over the table [-], 150 to 1 for another person. The file is refused below it twice in a
row."""


@dataclass
class PersonCheck:
    """Check of one motion."""

    model: ArmModel
    """Model of the check. No other motion uses it."""
    machine: CalibratedMachine
    by_file: Belief
    by_table: Belief
    evidence: dict[float, float] = field(default_factory=dict)
    """Log evidence of the file over the table, by seconds of motion."""

    def __post_init__(self):
        places = self.model.assembly.description.places
        sd = self.machine.residual_sd
        noise = Noise(sd, self.machine.correlation_s, disturbance_sd(places))
        self._unexplained = UnexplainedTorque(noise, Discrepancy.of_machine(sd))
        self._averages, self._means = Averages(BATCH_PERIOD_S), 0
        self._samples: list[Sample] = []

    def take(self, sample: Sample) -> bool:
        """Take one sample. Return True if the evidence has just been computed."""
        if len(self.evidence) == len(JUDGED_S):
            return False
        mean = self._averages.take(sample)
        if mean is not None:
            if self._means % ONE_IN == 0:
                self._samples.append(mean)
            self._means += 1
        due = JUDGED_S[len(self.evidence)]
        if sample.t < due:
            return False
        self.evidence[due] = log_odds(self.by_file, self.by_table, self._samples, self.model, self._unexplained)
        return True

    @property
    def is_contradicted(self) -> bool:
        """True if the file was contradicted twice in a row.

        Early, a slow torque of the wearer can contradict any narrow belief.
        """
        lately = list(self.evidence.values())[-2:]
        return len(lately) == 2 and max(lately) < CONTRADICTED
