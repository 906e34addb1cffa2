"""Command `exograv run console`."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.console.options import Address
from exograv.errors import ConfigError
from exograv.experiment.steered.options import SteeredOptions
from exograv.live.options import PersonForm
from exograv.options import Acts

if TYPE_CHECKING:
    from exograv.console.run import ConsoleResult
    from exograv.experiment.steered.interface import SteeredFlight


@dataclass(frozen=True)
class TrialOptions:
    """Task of the participant, and the machine."""

    protocol: str | None = None
    """Protocol of the participant: training, familiarisation, flight, or the path of a file. Without a protocol the
    pages only steer the machine."""

    aircraft: Annotated[tuple[int, ...] | None, tyro.conf.arg(metavar="[PORT]")] = None
    """Listen to the aircraft on this UDP port (3131 by default): its g opens and closes windows."""

    aircraft_sender: Annotated[str | None, Acts(lambda all_: all_.aircraft is not None, "with --aircraft")] = None
    """IPv4 address of the only aircraft sender that is accepted."""

    session: Annotated[int, Acts(lambda all_: all_.protocol is not None, "with --protocol")] = 1
    """Number of this person's session with this protocol; the checkpoint file has it in its name."""

    resume: bool = False
    """Resume an interrupted run at its next window."""

    rehearse: bool = False
    """Use no machine, not even the twin, to show and try the pages. Files go to the folder `rehearsal` in --out."""


def _port(given: tuple[int, ...]) -> int:
    from exograv.task.aircraft_line import PORT

    if len(given) > 1:
        raise ConfigError(f"--aircraft is {' '.join(map(str, given))}; give one port, or none for {PORT}.")
    return given[0] if given else PORT


def run_console_command(
    options: SteeredOptions, person: PersonForm, trial: TrialOptions, address: Address, common: OutFolder
) -> "ConsoleResult":
    """Serve pages for operator, therapist, participant and viewers of a live machine, and print the operator's link."""
    from exograv.console.run import run_console
    from exograv.console.trial_request import TrialRequest
    from exograv.experiment.steered.session_controller import SessionController

    def say(line: str) -> None:
        print(line, flush=True)

    address.check()
    if trial.rehearse and options.is_on_drives:
        raise ConfigError("--rehearse uses no machine. Leave it out, or leave out --drives and --simulate.")
    # A rehearsal must not block or change a session, and nobody must take its files for a session's.
    folder = common.out / "rehearsal" if trial.rehearse else common.out
    request = TrialRequest(
        folder=folder,
        protocol=trial.protocol,
        participant=options.participant,
        session=trial.session,
        rig="rehearsal" if trial.rehearse else options.rig,
        resumes=trial.resume,
        aircraft_port=None if trial.aircraft is None else _port(trial.aircraft),
        aircraft_sender=trial.aircraft_sender,
    )
    before = request.check()
    options = replace(options, side=options.side or before.side, run=request.stated(), rests=before.rests)
    if trial.rehearse:
        from exograv.experiment.steered.rehearsal import RehearsedFlight

        flight: SteeredFlight = RehearsedFlight(side=options.side or "right")
    else:
        from exograv.api.rig_factory import steered_flight

        flight = steered_flight(options, person, folder, "run console", say)
    desk = SessionController(flight)
    result = run_console(address, folder, desk, request, say)
    say(f"Ended. Diary of the pages: {result.diary}")
    return result
