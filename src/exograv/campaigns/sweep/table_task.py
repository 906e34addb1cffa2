"""What the table of anthropometry alone leaves over of an arm's weight: a third of a second a wearer, no motion."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict

from exograv.laboratory.truth_score import Examination
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.study.folder.columns import Column

from .identify_task import CASE_COLUMNS, CaseTask
from .task import SweepTask, TaskKind, Values, each
from .wearers import WearerGrid, refuse_other_rig


class TableGrid(WearerGrid):
    """Wearers."""

    def __len__(self) -> int:
        return self.cases_count

    def groups(self) -> Iterator[Sequence[CaseTask]]:
        """The wearers of one machine."""
        for sha256, cases in self.cases():
            yield [CaseTask(**asdict(case), rig_sha256=sha256) for case in cases]


def _run(task: SweepTask) -> Values:
    case = task.settings.case
    refuse_other_rig(case, task.settings.rig_sha256)
    laboratory = case.laboratory()
    assembly = laboratory.assembly()
    machine = nominal_machine(case.description, assembly.exo.phi)
    # Of the arm only: this machine was not calibrated.
    arm = Examination(laboratory, assembly, machine).score(table_guess(assembly, machine)).arm
    at = {
        where: [j for j, place in enumerate(case.description.places) if place == where]
        for where in ("shoulder", "elbow")
    }
    return {f"arm_left_over_{where}_Nm": float(arm[joints].max()) for where, joints in at.items() if joints}


TABLE = TaskKind(
    "table",
    "What the table of anthropometry alone leaves over of a wearer's arm.",
    TableGrid,
    CASE_COLUMNS,
    (
        Column(
            "arm_left_over_shoulder_Nm", "float64", "N·m", "worst axis, RMS over held-out postures", is_nullable=True
        ),
        Column("arm_left_over_elbow_Nm", "float64", "N·m", "the same at the elbow", is_nullable=True),
    ),
    ("wearer_seed",),
    each(_run),
)
