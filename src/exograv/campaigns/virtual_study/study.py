"""`exograv study simulate`: sessions and flights of all people, the study's folder, its report, and the page."""

import os
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from exograv import __version__
from exograv.errors import RecordingError
from exograv.loop.pilot import Progress
from exograv.report.study_report.report import write_study_report
from exograv.results import MERGED
from exograv.study.dataset.adding import add_files, worst
from exograv.study.dataset.options import AddOptions
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.codes import draw_code

from .ablation import Ablated, ablation
from .careers import Career, careers
from .checkpoint import CareerJob, lived_of
from .figure_sensitivity import SensitivityPoint
from .flight import VirtualFlight
from .options import StudyOptions, WorkOptions
from .out_folder import CAREERS, RECORDINGS, STUDY, SWEEP, out_folder
from .outcome import NO_EVIDENCE, StudyOutcome, outcome_of
from .page import Content, write_virtual_page
from .participants import ParticipantResult
from .sensitivity import sensitivity
from .small_study import FlightResources


@dataclass(frozen=True)
class RefusedTraining:
    """Virtual person whose machine was refused in a condition."""

    person: int
    condition: str
    why: str


@dataclass(frozen=True)
class TimeSpent:
    """Computing time of the study, over all processes."""

    wall_s: float
    spent_s: dict[str, float]
    simulated_s: float
    processors: int | None


@dataclass(frozen=True)
class VirtualStudyResult:
    """Result of `exograv study simulate`."""

    outcome: StudyOutcome = field(metadata=MERGED)
    sensitivity: Sequence[SensitivityPoint]
    ablation: Sequence[Ablated]
    refused: list[RefusedTraining]
    options: StudyOptions
    dataset: Path
    study_report: Path
    report: Path
    figures: tuple[Path, ...]
    time: TimeSpent


@dataclass(frozen=True)
class StudyComputation(WorkOptions):
    """Options of the computation, with the study's folder."""

    folder: Path = field(kw_only=True)


def simulate_study(
    options: StudyOptions,
    work: StudyComputation,
    progress: Progress,
    keep: Callable[[VirtualStudyResult], None] = lambda _result: None,
) -> VirtualStudyResult:
    """Simulate a study, or continue it.

    Args:
        options: Options that determine the figures.
        work: Options of the computation, and the folder.
        progress: Receives a sentence and the finished share.
        keep: Receives the figures of the study before a sweep or an ablation, which take longer, and after each.

    Raises:
        ConfigError: The folder holds another study, or a study without `resume`. Or another command uses it.
        ExogravError: A machine or run was refused, or the disk is full. Finished careers are kept.
        KeyboardInterrupt: Ctrl-C was pressed. Finished careers are kept.
    """
    begun = time.perf_counter()
    everybody = careers(options, _codes(options))
    with out_folder(work.folder, options, everybody, work.resume) as study:
        lived = _everybody_lived(everybody, options, work, study, progress)
        progress("Writing the reports", 0.0)
        flights = [flight for one in lived for flight in one.flights]
        telling = _Telling(options, work.folder, study, flights, _time_of(lived, time.perf_counter() - begun))
        telling.refused = [
            RefusedTraining(career.person, career.condition_name, one.refused)
            for career, one in zip(everybody, lived, strict=True)
            if one.refused is not None
        ]
        result = telling.told([], [])
        progress("Writing the reports", 1.0)
        swept, ablated = list[SensitivityPoint](), list[Ablated]()
        if work.ablate:
            keep(result)
            ablated = ablation(options, _means(work, "With one mechanism off at a time", progress))
            result = telling.told(swept, ablated)
        if work.sensitivity:
            keep(result)
            swept = sensitivity(options, _means(work, "What transfer depends on", progress))
            result = telling.told(swept, ablated)
    return result


def _means(work: StudyComputation, text: str, progress: Progress) -> FlightResources:
    return FlightResources(work.folder / SWEEP, work.processes, lambda share: progress(text, share))


class _Telling:
    """Writer of report, page and figures. The page is written again when more results exist."""

    def __init__(
        self,
        options: StudyOptions,
        folder: Path,
        study: StudyFolder,
        flights: Sequence[VirtualFlight],
        time: TimeSpent,
    ):
        """Write the study's own report."""
        self._options, self._folder, self._study, self._flights, self._time = options, folder, study, flights, time
        self._outcome = outcome_of(flights, options.main.name)
        self.refused = list[RefusedTraining]()
        """People whose machine was refused, with condition and reason."""
        self._report = write_study_report(study.path).report

    def told(self, swept: Sequence[SensitivityPoint], ablated: Sequence[Ablated]) -> VirtualStudyResult:
        """Write the page and return the result."""
        links = {"The report of the study": f"{STUDY}/report/{self._report.name}"}
        content = Content(
            self._outcome, self._flights, _shown(self._options), swept[1:], swept[0].transfer if swept else None, links,
            ablated, [f"V{one.person:02d} is left out of {one.condition}: {one.why}" for one in self.refused],
        )  # fmt: skip
        page, figures = write_virtual_page(self._folder, content)
        return VirtualStudyResult(
            self._outcome, swept, ablated, self.refused, self._options, self._study.path, self._report, page, figures,
            self._time,
        )  # fmt: skip


def _everybody_lived(
    everybody: Sequence[Career], options: StudyOptions, work: StudyComputation, study: StudyFolder, progress: Progress
) -> list[ParticipantResult]:
    """Return the result of each career: read from its file, or simulated."""
    jobs = [CareerJob(career, options, work.folder / CAREERS / f"{career.name}.json") for career in everybody]
    return lived_of(
        jobs, work.folder / RECORDINGS, work.processes,
        lambda share: progress("Virtual people train and fly", share), lambda lived: _add(study, lived),
    )  # fmt: skip


def _add(study: StudyFolder, lived: ParticipantResult) -> None:
    """Add recordings to the study's folder, as a laboratory would."""
    paths = [Path(file) for file in lived.files]
    if not paths:
        return
    outcomes = add_files(study, paths, AddOptions(replace=True))
    if worst(outcomes):
        raise RecordingError(next(one.sentence for one in outcomes if one.what in ("refused", "quarantined")))
    for path in paths:
        path.unlink()


def _codes(options: StudyOptions) -> tuple[str, ...]:
    chance, codes = random.Random(options.seed), list[str]()
    for _ in range(sum(options.participants)):
        codes.append(draw_code(codes, chance.choice))
    return tuple(codes)


def _shown(options: StudyOptions) -> dict[str, str]:
    return {
        "What it is": NO_EVIDENCE,
        "Trained, untrained": ", ".join(map(str, options.participants)),
        "Sessions before the flight": ", ".join(map(str, options.sessions)),
        "Sessions before flights that compare conditions": ", ".join(map(str, options.compared)),
        "Conditions": ", ".join(options.conditions),
        "Disturbance level": str(options.level),
        "Seed": str(options.seed),
        "Windows of each protocol, of the flight": ", ".join(
            "all" if count is None else str(count) for count in (options.windows, options.flight_windows)
        ),
        "Constants changed": ", ".join(f"{name} = {value:g}" for name, value in options.constants.items()) or "none",
        "exograv": __version__,
    }


def _time_of(lived: Sequence[ParticipantResult], wall_s: float) -> TimeSpent:
    spent = {name: round(sum(one.spent_s.get(name, 0.0) for one in lived), 1) for name in lived[0].spent_s}
    return TimeSpent(round(wall_s, 1), spent, round(sum(one.simulated_s for one in lived), 1), os.cpu_count())
