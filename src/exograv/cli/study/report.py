"""Command `exograv study report`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from exograv.report.study_report.report import StudyReportResult


@dataclass(frozen=True)
class StudyReport:
    """Options of `exograv study report`."""

    study: Annotated[Path, tyro.conf.Positional] = Path()
    """Folder of the study; by default the current folder."""


def run_study_report(command: StudyReport) -> "StudyReportResult":
    """Measure and compare a study, and write a page, a PDF and figures to report/ in its folder."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.report.study_report.report import write_study_report
    from exograv.study.folder.study_folder import UNFINISHED, StudyFolder

    with bars(FIRST_LINE_S) as progress:
        progress("Computing the tables of the study", 0.0)
        result = write_study_report(command.study, tell=lambda phase: progress(phase, 0.0))
    if result.compared.primary is None:
        print(result.compared.not_compared)
    else:
        print(f"{result.compared.primary.test}: {result.compared.primary.p_text}")
    if StudyFolder(command.study).is_unfinished:
        print(UNFINISHED)
    print(f"Report: {result.report}")
    print(result.remark or f"For print: {result.pdf}")
    return result
