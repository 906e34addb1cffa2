"""`exograv study report`."""

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
    """Folder of the study; the one you are in if absent."""


def run_study_report(command: StudyReport) -> "StudyReportResult":
    """Measure, compare and draw a study: report/ in its folder gets a page, a PDF and the figures."""
    from exograv.report.study_report.report import write_study_report

    result = write_study_report(command.study, tell=lambda source: print(f"Reading {source}"))
    if result.compared.primary is None:
        print(result.compared.not_compared)
    else:
        print(f"{result.compared.primary.test}: {result.compared.primary.p_text}")
    print(f"Report: {result.report}")
    print(result.remark or f"For print: {result.pdf}")
    return result
