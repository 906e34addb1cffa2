"""Verdicts of a campaign as rows of a file, so that one that was interrupted goes on."""

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
    """Of one campaign, by number; how many scenarios it was to have is no matter."""

    def __init__(self, folder: Path, campaign: Mapping[str, int | str | None], resume: bool):
        """Open.

        Args:
            folder: Where the file is.
            campaign: What a number's flight depends on besides the code.
            resume: Whether to go on with what is there; else it is kept beside.

        Raises:
            RecordingError: The file cannot be used.
        """
        head = {"exograv": __version__, "code": code_sha256(), **campaign}
        self._kept = CheckpointRows(folder / FILE, head, resume, row_of, verdict_of)
        self.verdicts = {verdict.scenario.number: verdict for verdict in self._kept.rows}

    @property
    def path(self) -> Path:
        """Of the file."""
        return self._kept.path

    def add(self, verdicts: Iterable[ScenarioVerdict]) -> None:
        """Keep more."""
        new = {verdict.scenario.number: verdict for verdict in verdicts}
        self._kept.add(*new.values())
        self.verdicts |= new


def row_of(verdict: ScenarioVerdict) -> dict[str, Any]:
    """In numbers and words."""
    row, course = asdict(verdict), verdict.course
    row["course"]["reason"] = None if course.reason is None else course.reason.name
    row["course"]["since"] = {state.name: tick for state, tick in course.since.items()}
    return row


def verdict_of(row: dict[str, Any]) -> ScenarioVerdict:
    """What `row_of` wrote.

    Raises:
        KeyError, TypeError, ValueError: This is no such row.
    """
    course, scenario = dict(row["course"]), dict(row["scenario"])
    reason = course["reason"]
    course["reason"] = None if reason is None else StopReason[reason]
    course["since"] = {SafeState[name]: tick for name, tick in course["since"].items()}
    scenario["faults"] = tuple(scenario["faults"])
    return ScenarioVerdict(
        **{**row, "course": ScenarioLog(**course), "scenario": Scenario(**scenario), "missed": tuple(row["missed"])}
    )
