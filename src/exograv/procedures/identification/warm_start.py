"""Warm start of a known participant from the stored belief, unless the first seconds of motion contradict it.

A second method starts cold, from the table, and takes the same samples. The difference between the two is the gain of
the file. It is computed from the stop rule's prediction, without any true values.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import IdentificationError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Outcome, Sample
from exograv.identification.core.left_over import TARGET_NM, LeftOverPrediction, StopRule
from exograv.identification.core.prior import prior
from exograv.identification.recursive.previous_session import carried_over
from exograv.model.assembly import Assembly
from exograv.storage.participant_schema import StoredParticipant

from .estimator_session import NOTE_S, Belief, build_method
from .person_check import PersonCheck

SECONDS_PER_DAY = 86400.0
FROM_FILE_S = 20.0
"""Duration of the motion of a returning participant [s]: all of ten were within target by then
(docs/howto/participants.md).
"""


def belief_today(
    whole: StoredParticipant, assembly: Assembly, machine: CalibratedMachine, now: datetime
) -> tuple[Belief, Belief]:
    """Mean and covariance before today's motion: by the file, and by the table alone."""
    table = prior(assembly, machine)
    days = (now - whole.identified.at_utc).total_seconds() / SECONDS_PER_DAY
    layout = ParameterLayout.of(assembly)
    return carried_over(layout, (whole.mean, whole.covariance), table, max(days, 0.0)), table


@dataclass
class MethodProgress:
    """Progress of one method through the motion, judged by its own covariance."""

    rule: StopRule
    target: np.ndarray
    stop_s: float | None = None
    outcome: Outcome = Outcome.RUNNING
    reached_s: float | None = None
    """Time from which the prediction stayed within the stop rule's target [s]; None if it never did."""

    def judge(self, estimate: Estimate, predicted: np.ndarray) -> None:
        """Judge one estimate; call once a second."""
        if (predicted <= self.target).all():
            self.reached_s = estimate.t if self.reached_s is None else self.reached_s
        else:
            self.reached_s = None
        if self.stop_s is None:
            verdict = self.rule.judge(estimate, predicted)
            if verdict is not Outcome.RUNNING:
                self.stop_s, self.outcome = estimate.t, verdict

    @property
    def figures(self) -> "ProgressFigures":
        """Figures for files and tables."""
        return ProgressFigures(self.reached_s, self.stop_s, self.outcome)


@dataclass(frozen=True)
class ProgressFigures:
    """Times at which one method came within the target, by its own prediction."""

    predicted_target_s: float | None
    stop_s: float | None
    outcome: Outcome


@dataclass(frozen=True)
class WarmStartFigures:
    """Comparison of the start from a participant's file with the start from the table."""

    code: str
    file: Path
    log_evidence_over_table: dict[str, float]
    """Evidence for the file by seconds of motion [nat]."""
    from_file: ProgressFigures
    cold: ProgressFigures
    saved_s: float | None


@dataclass
class WarmStart:
    """Observer of the samples of a participant whose file was given."""

    path: Path
    code: str
    belief: Belief
    """Mean and covariance by the file."""
    table: Belief
    assembly: Assembly
    machine: CalibratedMachine
    cold_estimates: list[Estimate] = field(default_factory=list)
    """Estimates of the method that started cold, one per second."""

    def begin(self, model: ArmModel) -> None:
        """Build the cold method and the check of the file, before the first sample."""
        places, joints = self.assembly.description.places, self.assembly.description.joints
        self._cold = build_method("recursive", self.assembly, self.machine, model.again())
        self._left_over = LeftOverPrediction(model.again(), self.table[0])
        target = np.array([TARGET_NM[place] for place in places])
        self.warm, self.cold = (MethodProgress(StopRule(places, joints), target) for _ in range(2))
        self._check = PersonCheck(model.again(), self.machine, self.belief, self.table)
        self._noted = 0.0

    def __call__(self, sample: Sample) -> None:
        """Take one sample.

        Raises:
            IdentificationError: The motion contradicts the file.
        """
        self._cold.update(sample)
        if self._check.take(sample) and self._check.is_contradicted:
            raise self._contradicted(sample.t)
        if sample.t - self._noted > NOTE_S - 1e-9:
            self._noted = sample.t
            estimate = self._cold.estimate()
            self.cold_estimates.append(estimate)
            predicted = self._left_over.of(estimate)
            if predicted is not None:
                self.cold.judge(estimate, predicted)

    def check(self, model: ArmModel, samples: Sequence[Sample]) -> None:
        """Compare the file with the samples of one motion, without the cold method.

        Raises:
            IdentificationError: The motion contradicts the file.
        """
        self._check = PersonCheck(model.again(), self.machine, self.belief, self.table)
        for sample in samples:
            if self._check.take(sample) and self._check.is_contradicted:
                raise self._contradicted(sample.t)

    def note(self, estimate: Estimate, predicted: np.ndarray | None) -> None:
        """Judge the estimate of the warm method, once a second."""
        if predicted is not None:
            self.warm.judge(estimate, predicted)

    def _contradicted(self, t: float) -> IdentificationError:
        odds = np.exp(min(-list(self._check.evidence.values())[-1], 20.0))
        return IdentificationError(
            f"{self.path} belongs to another person, or much has changed: after {t:.0f} s of motion the odds are "
            f"{odds:.0f} to 1 for a table person of this size against the arm of '{self.code}'. Check the code and "
            "any load in the hand. Without --participant the person is identified from the start."
        )

    @property
    def figures(self) -> WarmStartFigures:
        """Evidence for the file, and times to the target [s] with and without the file, for `--json`."""
        warm, cold = self.warm.reached_s, self.cold.reached_s
        return WarmStartFigures(
            code=self.code,
            file=self.path,
            log_evidence_over_table={f"{t:g}": round(value, 2) for t, value in self._check.evidence.items()},
            from_file=self.warm.figures,
            cold=self.cold.figures,
            saved_s=None if warm is None or cold is None else round(cold - warm, 1),
        )
