"""Task kind `table`: left over of an arm with anthropometric tables alone, without motion; 0.3 s per wearer."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated

from exograv.laboratory.truth_score import Examination
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess

from .identify_task import CaseTask
from .task import SweepTask, TaskKind, each
from .wearers import WearerGrid, refuse_other_rig


@dataclass(frozen=True)
class TableResult:
    """Left over of the arm by the table."""

    arm_left_over_shoulder_Nm: Annotated[float | None, "worst axis, RMS over held-out postures"] = None
    arm_left_over_elbow_Nm: Annotated[float | None, "elbow, RMS over held-out postures"] = None


class TableGrid(WearerGrid):
    """Grid of virtual wearers, each computed with the table alone."""

    def __len__(self) -> int:
        return self.cases_count

    def groups(self) -> Iterator[Sequence[CaseTask]]:
        """Yield the wearers of one machine together."""
        for sha256, cases in self.cases():
            yield [CaseTask(**asdict(case), rig_sha256=sha256) for case in cases]


def _run(task: SweepTask) -> TableResult:
    case = task.settings.case
    refuse_other_rig(case, task.settings.rig_sha256)
    laboratory = case.laboratory()
    assembly = laboratory.assembly()
    machine = nominal_machine(case.description, assembly.exo.phi)
    # Only the arm is scored, because this machine was not calibrated.
    arm = Examination(laboratory, assembly, machine).score(table_guess(assembly, machine)).arm
    at = {
        where: [j for j, place in enumerate(case.description.places) if place == where]
        for where in ("shoulder", "elbow")
    }
    return TableResult(
        **{f"arm_left_over_{where}_Nm": float(arm[joints].max()) for where, joints in at.items() if joints}
    )


TABLE = TaskKind(
    "table",
    "Left over of a wearer's arm with the anthropometric table alone.",
    TableGrid,
    CaseTask,
    TableResult,
    ("wearer_seed",),
    each(_run),
)
