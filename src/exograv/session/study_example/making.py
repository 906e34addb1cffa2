"""All sessions of all participants of the example, one process a participant: learning goes from session to session."""

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.session.provenance import laboratory_settings
from exograv.session.train.room import SimulatedRoom
from exograv.session.virtual import VirtualLaboratory, draw_laboratory
from exograv.task.plan import Plan
from exograv.task.protocol import LoadedProtocol, load_protocol

from .arm_tables import arm_tables
from .pointer import Pointer
from .session_file import ExampleSession

ACTIVE_RIG, PASSIVE_RIG = "recupera_like", "recupera_like_passive"
LEVEL = 2
GROUPS = {"trained": "training", "untrained": "familiarisation"}
"""What a group does before the flight."""

PARTICIPANTS_MAX, SESSIONS_MAX = 100, 99


@dataclass(frozen=True)
class ExampleOptions:
    """What is asked for."""

    participants: tuple[int, int] = (3, 3)
    """Trained, untrained."""

    sessions: tuple[int, int] = (16, 4)
    """Before the flight, of each."""

    seed: int = 0

    def __post_init__(self):
        """Refuse what cannot be.

        Raises:
            ConfigError: Names the option.
        """
        for name, pair, low, high in (
            ("participants", self.participants, 0, PARTICIPANTS_MAX),
            ("sessions", self.sessions, 0, SESSIONS_MAX),
        ):
            if len(pair) != 2 or not all(low <= value <= high for value in pair):
                given = ",".join(str(value) for value in pair)
                raise ConfigError(f"--{name} is {given}; give two numbers, trained and untrained: {low} to {high}.")
        if sum(self.participants) == 0:
            raise ConfigError("--participants is 0,0; a study has somebody in it.")


@dataclass(frozen=True)
class Somebody:
    """One of the participants."""

    code: str
    group: str
    seed: int
    sessions: int
    """Before the flight."""

    @property
    def files(self) -> tuple[tuple[str, int], ...]:
        """Protocol and number of each session, in their order."""
        return (*((GROUPS[self.group], k) for k in range(1, self.sessions + 1)), ("flight", 1))


def people(options: ExampleOptions, codes: list[str]) -> list[Somebody]:
    """Trained ones first; the seed of each is drawn from that of the study."""
    groups = [group for group, count in zip(GROUPS, options.participants, strict=True) for _ in range(count)]
    sessions = dict(zip(GROUPS, options.sessions, strict=True))
    seeds = np.random.default_rng([options.seed, 43]).integers(1000, 2**31, len(groups)).tolist()
    return [
        Somebody(code, group, seed, sessions[group]) for code, group, seed in zip(codes, groups, seeds, strict=True)
    ]


def make_recordings(everybody: list[Somebody], folder: Path, workers: int) -> Iterator[Path]:
    """Write each recording, and tell when one is there; a participant's come in their order.

    Raises:
        RecordingError: The folder cannot be written.
    """
    if workers == 1:
        for somebody in everybody:
            yield from _sessions_of(somebody, folder)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context) as pool:
        for paths in pool.map(partial(_all_of, folder=folder), everybody):
            yield from paths


def _all_of(somebody: Somebody, folder: Path) -> list[Path]:
    return list(_sessions_of(somebody, folder))


def _sessions_of(somebody: Somebody, folder: Path) -> Iterator[Path]:
    room, protocols = SimulatedRoom(), {name: load_protocol(name) for name in (*GROUPS.values(), "flight")}
    laboratories = {rig: draw_laboratory(rig, None, LEVEL, somebody.seed) for rig in (ACTIVE_RIG, PASSIVE_RIG)}
    target = protocols["flight"].settings.target
    tables = arm_tables(laboratories[ACTIVE_RIG], room, target)
    pointer = Pointer(tables, somebody.seed)
    for number, (protocol, session) in enumerate(somebody.files):
        loaded = protocols[protocol]
        laboratory = laboratories[ACTIVE_RIG if loaded.settings.exo == "active" else PASSIVE_RIG]
        plan = Plan(loaded, loaded.settings.exo, room.calibration)
        path = folder / f"{somebody.code}_{protocol}_{session:02d}.mcap"
        example = ExampleSession(plan, room, tables, pointer, somebody.seed + number)
        settings = _settings(somebody, laboratory, loaded, session, pointer, room)
        example.record(path, tuple(laboratory.description.joints), settings)
        pointer.adaptation.night()
        yield path


def _settings(
    somebody: Somebody,
    laboratory: VirtualLaboratory,
    loaded: LoadedProtocol,
    session: int,
    pointer: Pointer,
    room: SimulatedRoom,
) -> dict[str, Any]:
    whole = laboratory_settings(laboratory)
    whole["settings"] |= {
        "options": {"participant": somebody.code, "protocol": loaded.settings.name, "session": session},
        "protocol": loaded.recorded,
        "room": room.model_dump(),
        "participant_model": asdict(pointer.character),
    }
    whole["hashes"] |= {"protocol": loaded.sha256}
    return whole | {
        "command": "exograv study example --simulate",
        "disturbance_level": LEVEL,
        "seed": somebody.seed,
    }
