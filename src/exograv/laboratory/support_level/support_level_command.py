"""A test of support from end to end: prepare, search, try the answer, draw it."""

import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from exograv.laboratory.provenance import run_settings
from exograv.loop.pilot import Progress
from exograv.procedures.rehabilitation.support_level.outcome import figures
from exograv.procedures.rehabilitation.support_level.recorded_attempts import recorded_attempts
from exograv.procedures.rehabilitation.support_level.search import CRITERION, NeededSupport, search
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from exograv.procedures.rehabilitation.support_level.threshold import DRAWS_LAST, ThresholdSearch
from exograv.recording import RecordingWriter
from exograv.storage.self_test_pass import NOT_NEEDED

from .flight import Attempt, SupportFlight
from .options import SupportOptions
from .weak_participant import WeakParticipant, prepare_weak_participant


def run_support_level(options: SupportOptions, folder: Path, progress: Progress) -> dict[str, Any]:
    """Of a virtual person; the result follows the contract of `exograv support-level --json`.

    Raises:
        ConfigError: An option, a file or the machine cannot be used.
        RigError: The envelope stopped the run.
        RecordingError: The folder cannot be written.
    """
    start = time.perf_counter()
    one = prepare_weak_participant(options, progress)
    path = folder / f"{options.name}.mcap"
    with RecordingWriter(path, one.laboratory.description.joints, _settings(options, one)) as recording:
        flight = one.flight(options.seed, recording)
        needed, attempts = search_flight(flight, options.seed, progress)
        # With the answer, every target once: what came of the search is tried, not believed.
        confirmed = [flight.attempt(k, needed.ci[0]) for k in range(len(TARGETS))]
        flight.carry_all()
        tried = [(one.target, one.support, one.reached) for one in attempts]
        result = figures(needed, tried, sum(one.reached for one in confirmed)) | {
            "rig": one.laboratory.description.name,
            "disturbance_level": options.level,
            "seed": options.seed,
            "strength": one.weakness.strength.round(4).tolist(),
            "synergy": one.weakness.synergy,
            "rescues": flight.rescues,
            "simulated_s": round(flight.seconds, 1),
            "is_simulated": True,
        }
        recording.write("/result", one.known.t + flight.seconds, {"task": result, "rig": options.rig})
    return _drawn(result, folder, options.name) | {
        "recording": str(path),
        "self_test": NOT_NEEDED,
        "wall_s": round(time.perf_counter() - start, 1),
    }


def run_recorded(recording: Path, folder: Path, name: str) -> dict[str, Any]:
    """Of a recorded person.

    Raises:
        RecordingError: The recording cannot be read, or does not hold what it takes.
    """
    tried, is_simulated = recorded_attempts(recording)
    found = ThresholdSearch(len(TARGETS), CRITERION, 0)
    for target, support, reached in tried:
        found.take(target, support, reached)
    result = figures(NeededSupport(found.posterior(DRAWS_LAST), len(tried)), tried, None)
    return _drawn(result | {"is_simulated": is_simulated, "recording": str(recording)}, folder, name)


def search_flight(flight: SupportFlight, seed: int, progress: Progress) -> tuple[NeededSupport, list[Attempt]]:
    """Search with attempts that are flown; they are returned too."""
    attempts: list[Attempt] = []

    def tries(target: int, support: float) -> bool:
        attempts.append(flight.attempt(target, support))
        return attempts[-1].reached

    return search(tries, seed, progress), attempts


def _drawn(result: dict[str, Any], folder: Path, name: str) -> dict[str, Any]:
    from exograv.report.figures.support import write_support_figure  # Matplotlib: 0.4 s

    return result | {"figure": str(write_support_figure(result, folder / f"{name}.svg"))}


def _settings(options: SupportOptions, one: WeakParticipant) -> dict[str, Any]:
    # A file's place changes nothing; what it says is the weakness.
    settings = {
        "options": asdict(options) | {"person_file": None},
        "weakness": asdict(one.weakness) | {"strength": one.weakness.strength.tolist()},
    }
    return run_settings(one.laboratory, "exograv support-level", options.level, options.seed, settings)
