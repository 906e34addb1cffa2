"""Persons in a steered machine: known ones from a file, or unknown ones; identified arms are stored."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.live.arm_worker import LearnedArm
from exograv.live.learned_person import learned_person
from exograv.live.live_control import LivePlan
from exograv.live.live_flight import lesson_plan
from exograv.live.live_identification import person_believed, unknown_person
from exograv.live.procedure_orders import OrderMemory
from exograv.model.assembly import Assembly
from exograv.model.wearer_form import WearerForm
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept, ParticipantRun
from exograv.procedures.identification.warm_start import belief_today
from exograv.rig import Rig
from exograv.storage.participant_file import (
    new_code,
    read_participant,
    refuse_other,
    refuse_other_body,
    refuted_text,
    write_participant,
)
from exograv.storage.participant_schema import StoredParticipant
from exograv.storage.self_test_pass import MachineKey
from exograv.storage.session_checkpoint import CheckedArm


@dataclass(frozen=True)
class RequestedParticipant:
    """Request for a person in the machine."""

    participant: str | None
    """Code of a file; absent for an arm that is to be identified."""
    code: str | None
    """Code under which the arm is stored; a random one if absent."""
    identify_s: float
    """Duration of the motion [s]."""
    side: Side
    is_refuted: bool = False
    """True if there is a file under this code whose estimate disagreed with its check: the arm is identified again."""


@dataclass
class ParticipantFiles:
    """Files of a folder that fit one machine and its wearer."""

    assembly: Assembly
    """Machine with the table's arm of the wearer."""
    form: WearerForm
    """Body data and lengths of the wearer."""
    period_s: float
    machine: str
    """Serial number of the machine, or the name that replaces it for the twin."""
    folder: Path | None
    codes: tuple[str, ...] = field(init=False)
    """Codes of the persons with a file, as `keep` has written last."""
    refuted: tuple[str, ...] = field(init=False)
    """Codes of those whose estimate disagreed with its check: their arm is identified again."""

    def __post_init__(self) -> None:
        self._look()

    def _look(self) -> None:
        files = self.files()
        self.codes = tuple(files)
        self.refuted = tuple(code for code, whole in files.items() if refuted_text(whole))

    def files(self) -> dict[str, StoredParticipant]:
        """Read the stored participants of this machine, by code.

        Damaged files and files of other machines or persons are omitted.
        """
        assembly, now, found = self.assembly, datetime.now(UTC), dict[str, StoredParticipant]()
        for path in sorted(self.folder.glob("*.toml")) if self.folder is not None else ():
            with contextlib.suppress(ConfigError):
                whole = read_participant(path)
                refuse_other(path, whole, assembly, self.machine, now)
                refuse_other_body(path, whole, self.form.body)
                found[whole.person.code] = whole
        return found

    def plan(
        self,
        who: RequestedParticipant,
        prepared: ControllerKnowledge,
        rig: Callable[[], Rig],
        stack: contextlib.ExitStack,
        key: MachineKey | None = None,
        orders: OrderMemory | None = None,
    ) -> LivePlan:
        """Plan of guard, control and worker; takes seconds. The worker's memory exists as long as `stack`.

        Args:
            who: Person in the machine.
            prepared: Controller's knowledge of the machine.
            rig: Function that builds the machine. The process that owns the machine calls it.
            stack: Owner of the worker's memory.
            key: Key that unlocks a real machine; None for the twin.
            orders: Memory of the orders that move the identified arm; None without such orders.

        Raises:
            ConfigError: There is no such file any more.
        """
        assembly, machine, belief = prepared.assembly, prepared.machine, None
        if who.participant is None:
            person = unknown_person(assembly, machine)
        else:
            whole = self.files().get(who.participant)
            if whole is None:
                raise ConfigError(
                    f"There is no file of {who.participant} in {self.folder} any more. Choose another participant."
                )
            belief, _ = belief_today(whole, assembly, machine, datetime.now(UTC))
            prepared = replace(prepared, x=belief[0])
            person = person_believed(assembly, machine, belief)
        # The motion may be broken off and started again, and the worker needs memory for all samples.
        lesson = lesson_plan(
            prepared,
            who.identify_s,
            self.period_s,
            stack,
            passes_s=2.0 * who.identify_s,
            belief=belief,
            body_mass_kg=self.form.body.mass_kg,
        )
        period_ns = round(1e9 * self.period_s)
        return LivePlan(
            assembly.description,
            self.form,
            prepared,
            person,
            0.0,
            rig,
            period_ns,
            lesson,
            key,
            is_steered=True,
            orders=orders,
        )

    def keep(
        self, prepared: ControllerKnowledge, code: str | None, learned: LearnedArm, predicted: np.ndarray
    ) -> str | None:
        """Write the file of an identified person. Return the code; None if there is no estimate to store.

        Args:
            prepared: Machine with the arm in it.
            code: Code of the person; a random one if absent.
            learned: Estimate of the arm.
            predicted: Predicted residual torque per joint [N·m].

        Raises:
            ConfigError: The file cannot be written.
        """
        if self.folder is None:
            return None
        code = code or new_code()
        before = self.files().get(code)
        whole = learned_person(code, self.form.body, prepared, self.machine, learned, predicted, before)
        if whole is None:
            return None
        self.folder.mkdir(parents=True, exist_ok=True)
        write_participant(self.folder / f"{code}.toml", whole)
        self._look()
        return code

    def keep_rests(
        self, machine: CalibratedMachine, code: str | None, learned: CheckedArm, is_of_donning: bool
    ) -> KeptParticipant | NotKept | None:
        """Write an arm from rests into the file of a person, as a session in lock-step does; None without a folder.

        Args:
            machine: Machine as calibrated.
            code: Code of the person; a random one if absent.
            learned: Estimate of the arm.
            is_of_donning: True if the file is of the present donning.

        Raises:
            ConfigError: The file belongs to another machine or person, or cannot be written.
        """
        if self.folder is None:
            return None
        code = code or new_code()
        self.folder.mkdir(parents=True, exist_ok=True)
        run = ParticipantRun(
            ParticipantOptions.of_file(self.folder / f"{code}.toml", code),
            self.assembly,
            self.machine,
            self.form.body,
            datetime.now(UTC).replace(microsecond=0),
            keep_option="--participants",
            is_of_donning=is_of_donning,
        )
        written = run.keep_learned(learned, machine)
        self._look()
        return written
