"""Who may be put into a steered machine: somebody whose file is there, or anybody, to be identified."""

import contextlib
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError
from exograv.rig.twin.twin import PERIOD
from exograv.session.lesson import unknown_person
from exograv.session.live import lesson_plan
from exograv.session.live_control import Plan
from exograv.session.participant_file import read_participant, refuse_other, refuse_other_body
from exograv.session.participant_schema import StoredParticipant
from exograv.session.person_limits import person_limits
from exograv.session.prepare import Prepared
from exograv.session.returning import belief_today
from exograv.session.virtual import Told, VirtualLaboratory

from .wearer import attentive_twin


@dataclass(frozen=True)
class Don:
    """Who is put in, as it was asked for."""

    participant: str | None
    """Code of a file; absent for an arm that is to be identified."""
    identify_s: float


@dataclass(frozen=True)
class People:
    """Files of a folder that fit one machine and the person who is told to be in it."""

    laboratory: VirtualLaboratory
    machine: str
    """Its serial number, or what stands for it."""
    folder: Path | None

    def files(self) -> dict[str, StoredParticipant]:
        """Whoever was in this machine before, by code.

        Files of other machines and people are left out, and damaged ones.
        """
        assembly, now, found = self.laboratory.assembly(), datetime.now(UTC), dict[str, StoredParticipant]()
        for path in sorted(self.folder.glob("*.toml")) if self.folder is not None else ():
            with contextlib.suppress(ConfigError):
                whole = read_participant(path)
                refuse_other(path, whole, assembly, self.machine, now)
                refuse_other_body(path, whole, self.laboratory.body)
                found[whole.person.code] = whole
        return found

    def plan(self, who: Don, prepared: Prepared, seed: int, stack: contextlib.ExitStack) -> Plan:
        """What guard, control and worker are built from; seconds pass. A worker's memory is there as long as `stack`.

        Raises:
            ConfigError: There is no such file any more.
        """
        assembly, machine, lesson = prepared.assembly, prepared.machine, None
        if who.participant is None:
            person = unknown_person(assembly, machine)
            # Broken off and begun anew, all of it is kept for the worker.
            lesson = lesson_plan(prepared, who.identify_s, PERIOD, stack, passes_s=2.0 * who.identify_s)
        else:
            whole = self.files().get(who.participant)
            if whole is None:
                raise ConfigError(f"There is no file of {who.participant} in {self.folder} any more.")
            (mean, _), _ = belief_today(whole, assembly, machine, datetime.now(UTC))
            prepared = replace(prepared, x=mean)
            person = person_limits(assembly, machine, mean)
        told = Told(self.laboratory.body, dict(self.laboratory.wearer.lengths_given))
        rig = partial(attentive_twin, self.laboratory, seed, prepared.t)
        return Plan(self.laboratory.description, told, prepared, person, 0.0, rig, lesson=lesson, is_steered=True)
