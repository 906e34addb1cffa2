"""`exograv simulate-study`: everybody's sessions and flights, the study's folder, its report, the page."""

import json
import os
import random
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exograv import __version__
from exograv.errors import ConfigError, RecordingError
from exograv.session.pilot import Progress
from exograv.study.dataset.adding import AddOptions, add_files, worst
from exograv.study.dataset.beginning import begin_study
from exograv.study.dataset.folder import StudyFolder, write_text_whole
from exograv.study.dataset.settings import AS_PUBLISHED, Expected, StudySettings
from exograv.study.findings.report import write_study_report
from exograv.study.participants.codes import draw_code
from exograv.study.participants.register import new_participant

from .crew import live_all
from .flight import flight_of
from .options import Career, StudyOptions, careers
from .outcome import NO_EVIDENCE, outcome_of
from .page import Content, write_virtual_page
from .people import Lived
from .sensitivity import USUAL, sensitivity

SETTINGS, CAREERS, RECORDINGS, STUDY = "simulate_study.json", "careers", ".recordings", "study"


@dataclass(frozen=True)
class Work:
    """Where and how it is done."""

    folder: Path
    processes: int
    resume: bool
    sensitivity: bool = False
    """Whether every constant of the virtual person is swept, too."""


def simulate_study(options: StudyOptions, work: Work, progress: Progress) -> dict[str, Any]:
    """Run it; the result follows the contract of `exograv simulate-study --json`.

    Raises:
        ConfigError: The folder holds another study, or one that was begun, without `resume`.
        ExogravError: A machine or run was refused, or the disk is full; careers that were done are kept.
        KeyboardInterrupt: The same.
    """
    begun = time.perf_counter()
    everybody = careers(options, _codes(options))
    study = _begin(options, work, everybody)
    lived = _everybody_lived(everybody, options, work, study, progress)
    rows = sensitivity(options, options.participants[0], work.processes, progress) if work.sensitivity else []
    progress("Writing the reports", 0.0)
    flights = [flight for career in everybody for flight in lived[career.name].flights]
    outcome = outcome_of(flights, options.main.name)
    report = write_study_report(study.path)
    links = {"The report of the study": f"{STUDY}/report/{Path(report['report']).name}"}
    page, figures = write_virtual_page(
        work.folder, Content(outcome, flights, _shown(options), rows[1:], rows[0].transfer if rows else None, links)
    )
    progress("Writing the reports", 1.0)
    return {
        **outcome,
        "sensitivity": [asdict(row) | {"value": None if row.name == USUAL else row.value} for row in rows],
        "options": asdict(options),
        "dataset": str(study.path),
        "study_report": report["report"],
        "report": str(page),
        "figures": [str(path) for path in figures],
        "time": _time_of(lived.values(), time.perf_counter() - begun),
    }


def _begin(options: StudyOptions, work: Work, everybody: Sequence[Career]) -> StudyFolder:
    """The folder, new or as it was left."""
    folder, path = work.folder, work.folder / SETTINGS
    text = json.dumps({"version": __version__, **asdict(options)}, indent=1)
    study = StudyFolder(folder / STUDY)
    if work.resume:
        if not path.is_file():
            raise ConfigError(
                f"There is nothing to go on with: {path} is missing. Leave --resume out, and where {folder} is not "
                "empty give another --out."
            )
        if path.read_text(encoding="utf-8") != text:
            raise ConfigError(
                f"{folder} holds a study with other options, or of another version of exograv. Give the same as in "
                f"{path}, or another --out without --resume."
            )
        return study
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out is {folder}, a file; give a folder that is empty or not there yet.")
    if folder.exists() and any(folder.iterdir()):
        further = "Go on with the study in it by --resume, or give" if path.is_file() else "Give"
        raise ConfigError(f"{folder} is not empty. {further} another --out.")
    try:
        (folder / CAREERS).mkdir(parents=True)
        (folder / RECORDINGS).mkdir()
    except OSError as error:
        raise RecordingError(f"{folder} cannot be made: {error.strerror}. Give another --out.") from error
    study = begin_study(folder / STUDY, _settings_of_study(options))
    for career in everybody:
        if career.code is not None:
            new_participant(study, "untrained" if career.condition is None else "trained", career.code)
    write_text_whole(path, text)
    return study


def _everybody_lived(
    everybody: Sequence[Career], options: StudyOptions, work: Work, study: StudyFolder, progress: Progress
) -> dict[str, Lived]:
    """Of each career by its name: read where it is kept, gone through else."""
    kept = work.folder / CAREERS
    done = {career.name: read for career in everybody if (read := _read(kept / f"{career.name}.json")) is not None}
    left = [career for career in everybody if career.name not in done]

    going = dict[str, float]()

    def tell(name: str, share: float) -> None:
        going[name] = share
        whole = len(done) + sum(part for other, part in going.items() if other not in done)
        progress("Virtual people train and fly", whole / len(everybody))

    asked = [(career, options) for career in left]
    arriving = live_all(asked, work.folder / RECORDINGS, min(work.processes, max(len(left), 1)), tell)
    try:
        for k, lived in arriving:
            career = left[k]
            _add(study, lived)
            write_text_whole(kept / f"{career.name}.json", json.dumps(asdict(lived)))
            done[career.name] = lived
    finally:
        arriving.close()
    return done


def _add(study: StudyFolder, lived: Lived) -> None:
    """Into the study's folder, as a laboratory would."""
    paths = [Path(file) for file in lived.files]
    if not paths:
        return
    outcomes = add_files(study, paths, AddOptions(replace=True))
    if worst(outcomes):
        raise RecordingError(next(one.sentence for one in outcomes if one.what in ("refused", "quarantined")))
    for path in paths:
        path.unlink()


def _read(path: Path) -> Lived | None:
    if not path.is_file():
        return None
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
        flights = tuple(flight_of(one) for one in plain["flights"])
        return Lived(flights, tuple(plain["files"]), plain["spent_s"], plain["simulated_s"])
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"{path} cannot be read as what came of a career ({error}). Delete this file, and --resume goes through "
            "that career again."
        ) from None


def _codes(options: StudyOptions) -> tuple[str, ...]:
    chance, codes = random.Random(options.seed), list[str]()
    for _ in range(sum(options.participants)):
        codes.append(draw_code(codes, chance.choice))
    return tuple(codes)


def _settings_of_study(options: StudyOptions) -> StudySettings:
    trained, untrained = options.sessions
    expected = [
        Expected(protocol="training", sessions=trained, groups=["trained"]) if trained else None,
        Expected(protocol="familiarisation", sessions=untrained, groups=["untrained"]) if untrained else None,
        Expected(protocol="flight", sessions=1),
    ]
    groups = {
        "trained": f"{trained} trainings, condition {options.main.name}",
        "untrained": f"{untrained} familiarisations with the passive exoskeleton",
    }
    return AS_PUBLISHED.model_copy(
        update={
            "name": f"Virtual participants, seed {options.seed}",
            "groups": groups,
            "expected": [one for one in expected if one is not None],
            "is_simulated": True,
            "licence": "CC0-1.0",
        }
    )


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


def _time_of(lived: Sequence[Lived] | Any, wall_s: float) -> dict[str, Any]:
    """Where the time went, over all processes."""
    everybody = list(lived)
    spent = {name: round(sum(one.spent_s.get(name, 0.0) for one in everybody), 1) for name in everybody[0].spent_s}
    return {
        "wall_s": round(wall_s, 1),
        "spent_s": spent,
        "simulated_s": round(sum(one.simulated_s for one in everybody), 1),
        "processors": os.cpu_count(),
    }
