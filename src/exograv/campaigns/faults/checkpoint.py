"""Checkpoint of a campaign: verdicts as rows of a file, so that an interrupted campaign can continue."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from exograv import __version__
from exograv.recording.code import code_sha256
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason
from exograv.storage.checkpoint import CheckpointRows

from .scenario import Scenario, ScenarioVerdict
from .scenario_log import ScenarioLog

FILE = "faults.jsonl"


class KeptVerdicts:
    """Verdicts of one campaign by number. Campaigns of any number of scenarios can share them."""

    def __init__(self, folder: Path, campaign: Mapping[str, int | str | None], resume: bool):
        """Open the file.

        Args:
            folder: Folder of the file.
            campaign: Settings that, with the code, determine the scenario of each number.
            resume: True to continue with the rows in the file; else the old file is renamed and kept.

        Raises:
            RecordingError: The file cannot be used.
        """
        head = {"exograv": __version__, "code": code_sha256(), **campaign}
        self._kept = CheckpointRows(folder / FILE, head, resume, row_of, verdict_of)
        self.verdicts = {verdict.scenario.number: verdict for verdict in self._kept.rows}

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self._kept.path

    def add(self, verdicts: Iterable[ScenarioVerdict]) -> None:
        """Append verdicts to the file."""
        new = {verdict.scenario.number: verdict for verdict in verdicts}
        self._kept.add(*new.values())
        self.verdicts |= new


def row_of(verdict: ScenarioVerdict) -> dict[str, Any]:
    """Row of plain numbers and strings for a verdict."""
    row, course = asdict(verdict), verdict.course
    row["course"]["reason"] = None if course.reason is None else course.reason.name
    row["course"]["since"] = {state.name: tick for state, tick in course.since.items()}
    return row


def verdict_of(row: dict[str, Any]) -> ScenarioVerdict:
    """Read a row that `row_of` wrote.

    Raises:
        KeyError, TypeError, ValueError: The row has another form.
    """
    course, scenario = dict(row["course"]), dict(row["scenario"])
    reason = course["reason"]
    course["reason"] = None if reason is None else StopReason[reason]
    course["since"] = {SafeState[name]: tick for name, tick in course["since"].items()}
    scenario["faults"] = tuple(scenario["faults"])
    row = {**row, "course": ScenarioLog(**course), "scenario": Scenario(**scenario)}
    # A row of an earlier version has no `unexplained`: every miss failed its campaign.
    unexplained = tuple(row.get("unexplained", row["missed"]))
    return ScenarioVerdict(**{**row, "missed": tuple(row["missed"]), "unexplained": unexplained})
