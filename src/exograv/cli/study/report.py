"""`exograv study report`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro


@dataclass(frozen=True)
class StudyReport:
    """Options of `exograv study report`."""

    study: Annotated[Path, tyro.conf.Positional] = Path()
    """Folder of the study; the one you are in if absent."""


def run_study_report(command: StudyReport) -> dict[str, Any]:
    """Measure, compare and draw a study: report/ in its folder gets a page, a PDF and the figures."""
    from exograv.report.study_report.report import write_study_report

    result = write_study_report(command.study, tell=lambda source: print(f"Reading {source}"))
    if result["primary"] is None:
        print(result["not_compared"])
    else:
        primary = result["primary"]
        print(f"{primary['test']}: {primary['p_text']}")
    print(f"Report: {result['report']}")
    print(result["remark"] or f"For print: {result['pdf']}")
    return result
