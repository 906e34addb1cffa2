"""Machine on drives as a `SteeredMachine`: real, or simulated in another process. It needs no twin."""

import contextlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError, ExogravError
from exograv.live.live_processes import LiveResult
from exograv.live.on_drives.connection import Say, drawn_by, drives_of, not_ready, readiness_of
from exograv.live.on_drives.fault_lock import lock_after_fault
from exograv.live.on_drives.wearer_form import form_of_wearer
from exograv.live.options import PersonForm
from exograv.loop.machine_limits import limits, refuse_motorless
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.rig import Rig
from exograv.rig.drives.opening import open_drives
from exograv.storage.participant_file import read_participant
from exograv.storage.participant_schema import StoredPerson
from exograv.storage.self_test_pass import MachineKey

from .options import SteeredOptions
from .participants import ParticipantFiles
from .sentences import say
from .work_progress import CalibrationProgress


class DrivenMachine:
    """Machine on drives, which is calibrated and has passed its self-test today."""

    starts_on_request = True

    def __init__(
        self,
        options: SteeredOptions,
        person: PersonForm,
        folder: Path,
        command: str,
        tell: Say,
        wearer: SimulatedWearer | None = None,
    ):
        """Check the machine, and read its files. No bus is opened; simulated drives are started.

        Args:
            options: Options of the session.
            person: Form of the wearer.
            folder: Folder of the files of the machine.
            command: Command that asks for the machine.
            tell: Function that shows a line to the operator.
            wearer: Simulated wearer; None if machine and person are real.

        Raises:
            ExogravError: The machine is not ready, or a file or an option cannot be used.
        """
        self._options = options
        self.is_twin = options.simulate
        self.description = description = load_rig(options.rig, options.side)
        refuse_motorless(description)
        known = _known(options.participants, options.participant)
        self.form = form_of_wearer(description, person, options.simulate, wearer, known)
        with contextlib.ExitStack() as stack:
            refuse = not_ready(options, folder, description, command, tell)
            worn = ("--worn", "--donning", str(options.donning), *_stimulated(options))
            drives, self._bench = stack.enter_context(drives_of(options, description, worn, options.real_time, refuse))
            self._drives, self._readiness = drives, readiness_of(options, folder, description, drives)
            assembly = assemble(description, self.form.body)
            machine = self._readiness.calibration().whole.calibration()
            guess = table_guess(assembly, machine.machine)
            self._prepared = ControllerKnowledge(assembly, machine.machine, guess, 0.0, machine)
            serial = self._readiness.serial
            self.people = ParticipantFiles(assembly, self.form, drives.period_s, serial, options.participants)
            self._stack = stack.pop_all()
        self.torque_max_Nm = tuple(limits(description).torque_max_Nm.tolist())
        self.calibrating: CalibrationProgress | None = None

    @property
    def side(self) -> Side:
        """Side of the arm in the machine."""
        return self.description.side

    def prepare(self) -> ControllerKnowledge:
        """Return the controller's knowledge of the machine, from its calibration."""
        return self._prepared

    def machine_key(self) -> MachineKey:
        """Return the key that unlocks the machine.

        Raises:
            ConfigError: The calibration cannot be used.
        """
        return self._readiness.key

    def rig(self, _prepared: ControllerKnowledge, /) -> Callable[[], Rig]:
        """Return the function that opens the drives."""
        return partial(open_drives, self._drives, lock_step=self._options.waits)

    def recorded(self) -> Mapping[str, Any]:
        """Return the serial number of the machine, the options, the run, and the disturbances of simulated drives."""
        options = self._options
        settings = {"options": options.written(), "machine": self._readiness.serial}
        hashes = {} if options.allocation_sha256 is None else {"allocation": options.allocation_sha256}
        return {**drawn_by(options), "hashes": hashes, "settings": {**settings, **options.stated()}}

    def hear(self, mode_name: str) -> None:
        """Tell a simulated wearer the mode that begins."""
        if self._bench is not None:
            self._bench(f"mode {mode_name}")

    def ended(self, flown: LiveResult) -> str:
        """Lock the machine after a fault. Return the sentence for the operator; empty without a fault."""
        key = self.machine_key()
        cause = lock_after_fault(key, flown.report)
        return say("flight.locked", cause=cause, command=key.test) if cause else ""

    def close(self) -> None:
        """End the process of the simulated drives."""
        self._stack.close()


def machine_of_side(machine: DrivenMachine) -> Callable[[Side | None], DrivenMachine]:
    """Return the function that gives this machine for its own side only: another side has other drives.

    Raises:
        ConfigError: Another side was asked for.
    """

    def of_side(side: Side | None) -> DrivenMachine:
        if side not in (None, machine.side):
            raise ConfigError(
                f"The drives are those of the {machine.side} side; asked for: {side}. Run the command again with "
                f"--side {side} and the drives.toml of that side."
            )
        return machine

    return of_side


def _stimulated(options: SteeredOptions) -> tuple[str, ...]:
    """Options of simulated drives whose wearer points at a page that a stimulus process reads."""
    if options.stimulus is None:
        return ()
    return ("--person", "virtual", "--protocol", options.protocol_of_stimulus, "--line", str(options.stimulus))


def _known(folder: Path | None, code: str | None) -> StoredPerson | None:
    """Return the person of a participant's file; None if there is no file that can be read."""
    if folder is None or code is None:
        return None
    with contextlib.suppress(ExogravError):
        return read_participant(folder / f"{code}.toml").person
    return None
