"""Sessions of all participants of the example, one process per participant, because learning carries over."""

import os
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from exograv.errors import RecordingError
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.provenance import run_settings
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import RunSettings
from exograv.model.description import ACTIVE_RIG, PASSIVE_RIG
from exograv.runtime.processes.process_pool import Tell, in_order, results_of
from exograv.study.dataset.adding import add_files, worst
from exograv.study.dataset.beginning import begin_study
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.sources import placed_sources
from exograv.study.folder.settings import AS_PUBLISHED, StudySettings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.importers.imported_session import SessionKey
from exograv.study.participants.codes import draw_code
from exograv.study.participants.register import new_participant
from exograv.task.plan import TaskPlan
from exograv.task.protocol import LoadedProtocol, load_protocol

from .arm_tables import arm_tables
from .example_folder import example_folder
from .options import ExampleOptions
from .pointer import Pointer
from .session_file import ExampleSession

LEVEL = 2
GROUPS = {"trained": "training", "untrained": "familiarisation"}
"""Protocol of each group before the flight."""

STARTING, SIMULATING, ADDING = "Computing the participants' arms", "Simulating sessions", "Adding sessions to the study"
"""Phases of the command."""

LOST = (
    "Another program ended a process that simulates sessions, perhaps because memory ran out. Run the same command "
    "again; it continues with the missing sessions."
)


KEPT = "The sessions that were added stay in {path}. When the cause is removed, the same command continues."


@dataclass(frozen=True)
class ExampleParticipant:
    """Participant of the example."""

    code: str
    group: str
    seed: int
    sessions: int
    """Number of sessions before the flight."""

    @property
    def files(self) -> tuple[tuple[str, int], ...]:
        """Protocol and number of each session of this participant, in the order of the sessions."""
        return (*((GROUPS[self.group], k) for k in range(1, self.sessions + 1)), ("flight", 1))

    @property
    def keys(self) -> list[SessionKey]:
        """Keys of the sessions in the study."""
        return [SessionKey(self.code, protocol, number) for protocol, number in self.files]


def make_example(options: ExampleOptions, path: Path, progress: Progress, workers: int | None = None) -> StudyFolder:
    """Begin a study, simulate the sessions of all participants and add them, as a laboratory would.

    A study that was interrupted is continued with the participants whose sessions are not all there.

    Args:
        options: Options of the example.
        path: Folder of the study; it must not exist, or must hold an interrupted example with the same options.
        progress: Receives a sentence and the finished share.
        workers: Number of processes; one per processor if absent. The files do not depend on it.

    Raises:
        ConfigError: The folder is not empty, or another command uses it.
        RecordingError: The disk is full. Added recordings stay, and the same command continues.
    """
    try:
        return _completed(options, path, progress, workers or os.cpu_count() or 1)
    except RecordingError as error:
        raise RecordingError(f"{error} {KEPT.format(path=path)}") from error


def _completed(options: ExampleOptions, path: Path, progress: Progress, workers: int) -> StudyFolder:
    everybody = _people(options)
    with example_folder(path, options, partial(_begin, options=options, everybody=everybody)) as (folder, place):
        there = {source.note.key for source in placed_sources(folder)}
        left = [one for one in everybody if not there.issuperset(one.keys)]
        total = sum(len(one.files) for one in everybody)
        done = total - sum(len(one.files) for one in left)
        work, simulated = partial(_sessions_of, folder=place), done
        progress(STARTING, 0.0)

        def tell(_: object) -> None:
            nonlocal simulated
            simulated += 1
            progress(SIMULATING, simulated / total)

        # The study's files are added in the order of participants.
        arriving = results_of(work, left, workers, tell, LOST)
        for paths in in_order(arriving):
            progress(ADDING, done / total)
            outcomes = add_files(folder, paths, AddOptions())
            if worst(outcomes):
                raise RecordingError(next(one.sentence for one in outcomes if one.what in ("refused", "quarantined")))
            done += len(paths)
            for one in paths:
                one.unlink()
    progress(ADDING, 1.0)
    return folder


def _begin(path: Path, options: ExampleOptions, everybody: Sequence[ExampleParticipant]) -> None:
    folder = begin_study(path, _settings_of_study(options))
    for somebody in everybody:
        new_participant(folder, somebody.group, somebody.code)


def _settings_of_study(options: ExampleOptions) -> StudySettings:
    trained, untrained = options.sessions
    numbers = {"training": trained, "familiarisation": untrained, "flight": 1}
    expected = [
        one.model_copy(update={"sessions": numbers[one.protocol]})
        for one in AS_PUBLISHED.expected
        if numbers[one.protocol]
    ]
    groups = {
        "trained": f"{trained} trainings in simulated microgravity with the active exoskeleton",
        "untrained": f"{untrained} familiarisations with the passive exoskeleton",
    }
    named = f"Example with simulated participants, seed {options.seed}"
    return AS_PUBLISHED.model_copy(
        update={"name": named, "groups": groups, "expected": expected, "is_simulated": True, "licence": "CC0-1.0"}
    )


def _people(options: ExampleOptions) -> list[ExampleParticipant]:
    """Draw the participants, trained ones first; codes and seeds follow from the seed of the study."""
    groups = [group for group, count in zip(GROUPS, options.participants, strict=True) for _ in range(count)]
    sessions = dict(zip(GROUPS, options.sessions, strict=True))
    chance, codes = random.Random(options.seed), list[str]()
    for _ in groups:
        codes.append(draw_code(codes, chance.choice))
    seeds = np.random.default_rng([options.seed, 43]).integers(1000, 2**31, len(groups)).tolist()
    return [
        ExampleParticipant(code, group, seed, sessions[group])
        for code, group, seed in zip(codes, groups, seeds, strict=True)
    ]


def _sessions_of(somebody: ExampleParticipant, tell: Tell, folder: Path) -> Iterator[list[Path]]:
    """Write all recordings of one person. The person keeps what was learned in earlier recordings."""
    paths = list[Path]()
    room, protocols = SimulatedRoom(), {name: load_protocol(name) for name in (*GROUPS.values(), "flight")}
    laboratories = {rig: draw_laboratory(rig, None, LEVEL, somebody.seed) for rig in (ACTIVE_RIG, PASSIVE_RIG)}
    target = protocols["flight"].settings.target
    tables = arm_tables(laboratories[ACTIVE_RIG], room, target)
    pointer = Pointer(tables, somebody.seed)
    for number, (protocol, session) in enumerate(somebody.files):
        loaded = protocols[protocol]
        laboratory = laboratories[ACTIVE_RIG if loaded.settings.exo == "active" else PASSIVE_RIG]
        plan = TaskPlan(loaded, loaded.settings.exo, room.calibration)
        path = folder / f"{somebody.code}_{protocol}_{session:02d}.mcap"
        example = ExampleSession(plan, room, tables, pointer, somebody.seed + number)
        settings = _settings(somebody, laboratory, loaded, session, pointer, room)
        example.record(path, tuple(laboratory.description.joints), settings)
        pointer.adaptation.night()
        paths.append(path)
        tell(path.name)
    yield paths


def _settings(
    somebody: ExampleParticipant,
    laboratory: VirtualLaboratory,
    loaded: LoadedProtocol,
    session: int,
    pointer: Pointer,
    room: SimulatedRoom,
) -> RunSettings:
    settings = {
        "options": {"participant": somebody.code, "protocol": loaded.settings.name, "session": session},
        "protocol": loaded.recorded,
        "room": room,
        "participant_model": pointer.character,
    }
    command, hashes = "exograv study example --simulate", {"protocol": loaded.sha256}
    return run_settings(laboratory, command, LEVEL, somebody.seed, settings, hashes)
