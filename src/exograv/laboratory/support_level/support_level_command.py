"""Complete support test: prepare, search, confirm the result, and draw it."""

import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.laboratory.provenance import run_settings
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import RunSettings, TwinRun
from exograv.procedures.rehabilitation.support_level.options import SupportOptions
from exograv.procedures.rehabilitation.support_level.outcome import figures
from exograv.procedures.rehabilitation.support_level.recorded_attempts import recorded_attempts
from exograv.procedures.rehabilitation.support_level.search import CRITERION, NeededSupport
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from exograv.procedures.rehabilitation.support_level.tested_support import draw_outcome, search_and_test
from exograv.procedures.rehabilitation.support_level.threshold import DRAWS_LAST, ThresholdSearch
from exograv.recording import RecordingWriter
from exograv.report.figures.support_data import SupportOutcome
from exograv.results import MERGED, json_value
from exograv.storage.self_test_pass import NOT_NEEDED

from .weak_participant import WeakParticipant, prepare_weak_participant

OF_DRIVES = ("drives", "simulate", "calibration", "real_time", "identify_s")
"""Options that are absent from the recording of a twin."""


@dataclass(frozen=True)
class VirtualSupport:
    """Test of a virtual person, as its recording stores it."""

    outcome: SupportOutcome = field(metadata=MERGED)
    run: TwinRun = field(metadata=MERGED)
    strength: np.ndarray
    synergy: float
    rescues: int
    """Number of times that the arm sank and was carried again."""
    simulated_s: float
    is_simulated: bool


@dataclass(frozen=True)
class SupportResult:
    """Result of `exograv run support-level` for a virtual person."""

    found: VirtualSupport = field(metadata=MERGED)
    figure: Path
    recording: Path
    self_test: str
    wall_s: float


@dataclass(frozen=True)
class RecordedSupport:
    """Result of `exograv run support-level` for a recorded person."""

    outcome: SupportOutcome = field(metadata=MERGED)
    is_simulated: bool
    recording: Path
    figure: Path


def run_support_level(options: SupportOptions, folder: Path, progress: Progress) -> SupportResult:
    """Test a virtual person.

    Raises:
        ConfigError: An option, a file or the machine is not valid.
        RigError: The envelope stopped the run.
        RecordingError: The folder cannot be written.
    """
    start = time.perf_counter()
    one = prepare_weak_participant(options, progress)
    path = folder / f"{options.name}.mcap"
    with RecordingWriter(path, one.laboratory.description.joints, json_value(_settings(options, one))) as recording:
        flight = one.flight(options.seed, recording)
        outcome = search_and_test(flight, options.seed, progress).outcome
        found = VirtualSupport(
            outcome,
            TwinRun(one.laboratory.description.name, options.level, options.world, options.seed),
            one.weakness.strength.round(4),
            one.weakness.synergy,
            flight.rescues,
            round(flight.seconds, 1),
            is_simulated=True,
        )
        recording.write("/result", one.known.t + flight.seconds, {"task": json_value(found), "rig": options.rig})
    figure = draw_outcome(found.outcome, True, folder / f"{options.name}.svg")
    return SupportResult(found, figure, path, NOT_NEEDED, round(time.perf_counter() - start, 1))


def run_recorded(recording: Path, folder: Path, name: str) -> RecordedSupport:
    """Evaluate the test of a recorded person.

    Raises:
        RecordingError: The recording cannot be read, or has no such test.
    """
    tried, is_simulated = recorded_attempts(recording)
    found = ThresholdSearch(len(TARGETS), CRITERION, 0)
    for target, support, reached in tried:
        found.take(target, support, reached)
    outcome = figures(NeededSupport(found.posterior(DRAWS_LAST), len(tried)), tried, None)
    return RecordedSupport(
        outcome, is_simulated, recording, draw_outcome(outcome, is_simulated, folder / f"{name}.svg")
    )


def _settings(options: SupportOptions, one: WeakParticipant) -> RunSettings:
    # The path of a file changes no result. Its content is recorded as the weakness.
    taken = {name: value for name, value in json_value(options).items() if name not in OF_DRIVES}
    settings = {
        "options": taken | {"person_file": None},
        "weakness": one.weakness,
    }
    return run_settings(one.laboratory, "exograv run support-level", options.level, options.seed, settings)
