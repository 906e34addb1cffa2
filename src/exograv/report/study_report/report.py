"""Report of a study: measure, compare if possible, and write."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from exograv.files import write_whole
from exograv.results import MERGED, json_value
from exograv.study.dataset.making import refresh
from exograv.study.dataset.quarantine import quarantined
from exograv.study.folder.journal import alone, read_journal
from exograv.study.folder.settings import read_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.measures.emg_effort import measure_emg, muscle_effort
from exograv.study.measures.stored import measure_study
from exograv.study.measures.study_data import PRIMARY, StudyData
from exograv.study.statistics.compare import CompareSettings, compare
from exograv.study.statistics.findings import ComparisonFigures, StudyFindings

from .chapters import Content
from .page import WrittenReport, write_study_page
from .planning import next_study
from .quality import QualityStatement, issues


@dataclass(frozen=True)
class StudyReportResult:
    """Result of `exograv study report`."""

    compared: ComparisonFigures = field(metadata=MERGED)
    simulated: bool
    figures: Sequence[Path]
    report: Path
    pdf: Path | None
    remark: str | None
    """Reason why there is no PDF; None if there is a PDF."""


def write_study_report(path: Path, tell: Callable[[str], object] = lambda text: None) -> StudyReportResult:
    """Measure, compare, draw and write the report of a study.

    Args:
        path: Folder of the study.
        tell: Called with each phase: a sentence without its full stop.

    Raises:
        ConfigError: The folder is no study, or another command is changing it.
        RecordingError: A table cannot be read, or a file cannot be written.
    """
    folder = StudyFolder(path)
    settings = read_settings(folder)
    with alone(folder):
        tables = refresh(folder)
        measured = measure_study(folder, tables, lambda source: tell(f"Reading {source}"))
        tell("Comparing the groups")
        data = StudyData(settings, tables, measured.measures, measured.traces)
        why_not = reason_not_to_compare(data)
        found = None if why_not else compared(data)
        flaws = issues(data, QualityStatement(quarantined(folder), read_journal(folder), measured.remarks))
        planned = None if found is None else next_study(data, found.groups)
        emg = measure_emg(folder, tables, settings.streams, lambda source: tell(f"Reading EMG of {source}"))
        effort = muscle_effort(emg, data)
        content = Content(data, found, why_not, flaws, measured.unpublished, planned, effort, folder.is_unfinished)
        tell("Drawing the figures, and writing the page and its PDF")
        written = write_study_page(folder.report, content)
        if found is not None:
            text = json.dumps(json_value(found), indent=1, ensure_ascii=False)
            write_whole(folder.derivatives / "statistics.json", text + "\n")
        if effort is not None and not data.is_sealed:
            text = json.dumps(json_value(effort), indent=1, ensure_ascii=False)
            write_whole(folder.derivatives / "effort.json", text + "\n")
    return answer(data, found, why_not, written)


def reason_not_to_compare(data: StudyData) -> str:
    """Reason why groups are not compared, and the next step; empty if two groups can be compared."""
    named = list(data.settings.groups)[:2]
    if data.touches.empty:
        return "There are no accepted touches, so there is no comparison. Add sessions with `exograv study add`."
    if data.is_sealed:
        return "Groups are sealed, so there is no comparison. Unseal them when the data are complete, and report again."
    if len(named) < 2:
        return "The study has only one group, so there is no comparison. The following describes this group."
    if not data.has_primary:
        return (
            f"There are no accepted touches of a `{PRIMARY}`, so the study's main comparison is not possible yet. "
            "Figures show the last session of each person; groups with different protocols there are not compared."
        )
    there = set(data.compared["group"])
    if empty := [name for name in named if name not in there]:
        return f"No participant of the group {' or '.join(empty)} flew, so there is no comparison."
    return ""


def compared(data: StudyData) -> StudyFindings:
    """Compare the first two groups of the settings by their accepted touches."""
    first, second = list(data.settings.groups)[:2]
    settings = CompareSettings(groups=(first, second), protocol=PRIMARY)
    return compare(data.tidy_touches, data.tables.participants, settings)


def answer(data: StudyData, found: StudyFindings | None, why_not: str, written: WrittenReport) -> StudyReportResult:
    """Return the result that the command prints."""
    if found is not None:
        figures = found.contract()
    else:
        members = list(data.group_of.values())
        named = () if data.is_sealed else tuple(data.settings.groups)
        people = {group: members.count(group) for group in dict.fromkeys([*named, *data.groups])}
        touches = len(data.compared) if len(data.touches) else 0
        figures = ComparisonFigures(people, touches, deviation_px={}, not_compared=why_not)
    return StudyReportResult(figures, data.is_simulated, written.figures, written.html, written.pdf, written.remark)
