"""Checklist of a machine on drives with its person and its session, and the command to run now (`exograv next`)."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.live.options import NextOptions
from exograv.model.description import load_rig
from exograv.next_command import same_machine
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig.drives.settings import Drives, load_drives
from exograv.storage.acceptance_protocol import FILE, read_protocol_of
from exograv.storage.machine_readiness import Check, MachineReadiness, age_text
from exograv.storage.session_readiness import FORM, SessionReadiness, participants_in

from .connection import readiness_of


@dataclass(frozen=True)
class NextStep:
    """Result of `exograv next`."""

    rig: str
    side: str
    serial: str
    ready: bool
    """True if every check is passed."""
    checks: list[Check]
    command: str
    """Command to run now."""


def next_step(options: NextOptions, folder: Path) -> NextStep:
    """Read the files of a machine, a person and a session. Nothing is opened or written.

    Raises:
        ConfigError: The machine, its drives.toml or the protocol cannot be used.
    """
    description = load_rig(options.rig, options.side)
    with tempfile.TemporaryDirectory() as spare:
        path = options.drives or written(Path(spare), description)
        drives = load_drives(path, description)
    machine = readiness_of(options, folder, description, drives)
    checks = [_of_drives(options, drives), *machine.checks(), _of_acceptance(machine)]
    command = same_machine("run train", options, folder, " ".join(("--participant CODE", _form(options))).strip())
    if options.participant is not None:
        people = options.participants or participants_in(folder)
        session = SessionReadiness(
            machine, options.participant, people, options.protocol, options.session, options.study
        )
        checks += session.checks()
        command = checks[-1].command
    command = next((check.command for check in checks if not check.is_ready), command)
    return NextStep(
        description.name, description.side, machine.serial, all(check.is_ready for check in checks), checks, command
    )


def _of_drives(options: NextOptions, drives: Drives) -> Check:
    file = "simulated" if options.drives is None else str(options.drives)
    return Check("drives", True, f"{file}: {len(drives.joints)} drives on {drives.settings.bus}.")


def _of_acceptance(machine: MachineReadiness) -> Check:
    """Return the state of the acceptance. No command refuses a machine without it: the laboratory decides."""
    name, options = "acceptance", machine.options
    if options.simulate:
        return Check(name, True, "not needed: the drives are simulated.")
    command = same_machine("rig accept", options, machine.folder, "--by INITIALS")
    again = f"Accept the machine before the first person: `{command}`."
    try:
        whole = read_protocol_of(machine.folder / FILE, machine.description, machine.serial, again)
    except ConfigError as error:
        return Check(name, False, str(error), command)
    if whole.done.state != "passed":
        return Check(name, False, f"{machine.folder / FILE} says: {whole.done.state}. {again}", f"{command} --resume")
    if whole.key.drives_sha256 != machine.drives.sha256:
        return Check(name, False, f"{machine.folder / FILE} belongs to another drives.toml. {again}", command)
    age = age_text(machine.now - whole.done.written)
    return Check(name, True, f"passed {age} ago with the dummy '{whole.key.dummy}', by {whole.done.by}.")


def _form(options: NextOptions) -> str:
    return "" if options.simulate else FORM
