"""Sessions and flights of one virtual person in order. The person keeps what was learned in earlier sessions."""

import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError, IdentificationError, RigError
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.laboratory.provenance import run_settings
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import RunSettings
from exograv.recording import RecordingWriter
from exograv.results import json_value
from exograv.rig.twin import day_seed
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.plan import TaskPlan
from exograv.task.protocol import LoadedProtocol, first_windows, load_protocol

from .careers import Career
from .flight import Group, VirtualFlight
from .options import StudyOptions
from .session_setup import (
    SessionSetup,
    TrainingKnowledge,
    cached_training,
    familiarisation_setup,
    flight_setup,
    training_setup,
)
from .session_simulation import ACT_TICKS, SimulatedSession

FLIGHT_DAY = 1000
"""Day number of a flight. It is fixed, so that the air of that day does not depend on the number of trainings."""


@dataclass(frozen=True)
class ParticipantResult:
    """Result of one career: all sessions and flights of one virtual person."""

    flights: tuple[VirtualFlight, ...]
    files: tuple[str, ...]
    """Paths of the recordings for the study."""

    spent_s: dict[str, float] = field(default_factory=dict)
    """Wall time by activity [s]."""

    simulated_s: float = 0.0
    """Time that the twin simulated [s]."""

    refused: str | None = None
    """Reason why this person was refused in this condition; None if not refused."""


class ParticipantSimulation:
    """Simulation of one career: the sessions and flights of one virtual person, in order."""

    def __init__(self, career: Career, options: StudyOptions, folder: Path, progress: Progress):
        """Prepare the career; no session has run yet. Recordings go into `folder`."""
        self._career, self._options, self._folder, self._progress = career, options, folder, progress
        self._room = SimulatedRoom()
        self._learned: LearnedState | None = None
        self._spent = {"preparing": 0.0, "sessions": 0.0, "flights": 0.0}
        self._simulated_s, self._files = 0.0, list[str]()
        self._parts_done = 0
        self._prepared: TrainingKnowledge | None = None

    def run(self) -> ParticipantResult:
        """Run all sessions and flights.

        If the machine is refused, a comparison has one person less; in the main study it is an error.

        Raises:
            ExogravError: A machine or run was refused, or the disk is full.
        """
        career, flights = self._career, list[VirtualFlight]()
        if career.condition is not None:
            try:
                with self._timed("preparing"):
                    self._prepared = cached_training(career.condition, career.seed, self._options.level, self._tell)
            except (ConfigError, IdentificationError, RigError) as error:
                if career.code is not None:
                    raise
                return ParticipantResult((), (), self._spent, 0.0, str(error))
            self._parts_done += 1
        for session in range(career.sessions + 1):
            if session:
                with self._timed("sessions"):
                    self._train(session)
            for after, group in career.flights:
                if after == session:
                    with self._timed("flights"):
                        flights.append(self._fly(session, group))
        return ParticipantResult(tuple(flights), tuple(self._files), self._spent, self._simulated_s)

    def _train(self, session: int) -> None:
        career, level = self._career, self._options.level
        loaded = self._loaded(self._protocol, self._options.windows)
        if self._prepared is None:
            stage = familiarisation_setup(career.seed, level, session)
        else:
            stage = training_setup(self._prepared, session)
        _sitting, self._learned = self._sit(stage, loaded, session, session, is_kept=True)

    def _fly(self, session: int, group: Group) -> VirtualFlight:
        career, options = self._career, self._options
        loaded = self._loaded("flight", options.windows if options.flight_windows is None else options.flight_windows)
        stage = flight_setup(career.seed, options.level, FLIGHT_DAY)
        is_main = group != "comparison"
        sitting, _learned = self._sit(stage, loaded, FLIGHT_DAY, 1, is_kept=is_main)
        prepared = self._prepared
        return VirtualFlight(
            person=career.person,
            condition=career.condition_name,
            group=group,
            sessions=session,
            left_over_Nm=None if prepared is None else prepared.left_over_Nm,
            friction_Nm=None if prepared is None else prepared.friction_Nm,
            touches=tuple(sitting.touches),
        )

    @property
    def _protocol(self) -> str:
        condition = self._career.condition
        if condition is None:
            return "familiarisation"
        return "flight" if condition.training == "parabolic" else "training"

    def _loaded(self, protocol: str, windows: int | None) -> LoadedProtocol:
        loaded = load_protocol(protocol)
        return loaded if windows is None else first_windows(loaded, windows)

    def _sit(
        self, stage: SessionSetup, loaded: LoadedProtocol, day: int, number: int, is_kept: bool
    ) -> tuple[SimulatedSession, LearnedState]:
        """Run one session. Return it with the learned state of the next morning."""
        career, room = self._career, self._room
        plan = TaskPlan(loaded, stage.exo, room.calibration)
        person = self._person(stage, loaded, day)
        seed = day_seed(career.seed, day)
        sitting = SimulatedSession(stage, plan, room, person, seed)
        begun, tell = stage.twin.t, partial(self._tell, "")
        if career.code is None or not is_kept:
            sitting.fly(None, tell)
        else:
            path = self._folder / f"{career.code}_{loaded.settings.name}_{number:02d}.mcap"
            settings = self._settings(stage, loaded, number, seed, person.habits)
            with RecordingWriter(path, stage.twin.joints, json_value(settings)) as recording:
                sitting.fly(recording, tell)
                recording.write("/result", stage.twin.t, {
                    "task": json_value(sitting.run.totals().figures()), "rig": settings.rig,
                    "joints": list(stage.twin.joints), "seed": seed, "simulated_s": round(stage.twin.t - begun, 3),
                })  # fmt: skip
            self._files.append(str(path))
        self._simulated_s += sitting.simulated_s
        self._parts_done += 1
        person.adaptation.night()
        return sitting, person.learned

    def _person(self, stage: SessionSetup, loaded: LoadedProtocol, day: int) -> PointingPerson:
        protocol = loaded.settings
        person = PointingPerson(
            stage.own,
            stage.worn_inertia,
            stage.surroundings,
            self._room.on_panel(*self._room.target_px(protocol.target)),
            protocol.pace.too_short.shape,
            self._career.seed,
            ACT_TICKS * stage.twin.period_s,
            self._options.habits,
        )
        person.inner_ear = lambda: stage.twin.room_gravity
        person.begin_day(day)
        if self._learned is not None:
            person.remember(self._learned)
        return person

    def _settings(
        self, stage: SessionSetup, loaded: LoadedProtocol, number: int, seed: int, habits: Habits
    ) -> RunSettings:
        settings = {
            "options": {"participant": self._career.code, "protocol": loaded.settings.name, "session": number},
            "protocol": loaded.recorded,
            "room": self._room,
            "participant_model": habits,
            "condition": self._career.condition_name,
        }
        command, hashes = "exograv study simulate --simulate", {"protocol": loaded.sha256}
        return run_settings(stage.laboratory, command, self._options.level, seed, settings, hashes)

    def _tell(self, _text: str, share: float) -> None:
        """Report the finished share of this person's work; `share` is that of the present part."""
        parts = self._career.sessions + len(self._career.flights) + (self._career.condition is not None)
        self._progress(self._career.name, (self._parts_done + share) / parts)

    def _timed(self, what: str) -> "_Timed":
        return _Timed(self._spent, what)


class _Timed:
    """Context that adds the wall time of a block to an account."""

    def __init__(self, account: dict[str, float], what: str):
        self._account, self._what = account, what

    def __enter__(self) -> None:
        self._begun = time.perf_counter()

    def __exit__(self, *_of_error: object) -> None:
        self._account[self._what] += time.perf_counter() - self._begun


def simulate_participant(career: Career, options: StudyOptions, folder: Path, progress: Progress) -> ParticipantResult:
    """Simulate one career, from the first session to the last flight.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full.
    """
    return ParticipantSimulation(career, options, folder, progress).run()
