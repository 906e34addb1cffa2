"""Command `exograv run console`."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.console.options import Address
from exograv.experiment.steered.options import SteeredOptions
from exograv.options import Acts

if TYPE_CHECKING:
    from pathlib import Path

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


def _flight(options: SteeredOptions, is_rehearsed: bool, folder: "Path") -> "SteeredFlight":
    from exograv.experiment.steered.live_session import LiveFlight
    from exograv.experiment.steered.rehearsal import RehearsedFlight

    return RehearsedFlight(side=options.side or "right") if is_rehearsed else LiveFlight(options, folder)


def _port(given: tuple[int, ...]) -> int:
    from exograv.errors import ConfigError
    from exograv.task.aircraft_line import PORT

    if len(given) > 1:
        raise ConfigError(f"--aircraft is {' '.join(map(str, given))}; give one port, or none for {PORT}.")
    return given[0] if given else PORT


def run_console_command(
    options: SteeredOptions, trial: TrialOptions, address: Address, common: OutFolder
) -> "ConsoleResult":
    """Serve pages for operator, therapist, participant and viewers of a live machine, and print the operator's link."""
    from exograv.console.run import run_console
    from exograv.console.trial_request import TrialRequest
    from exograv.experiment.steered.session_controller import SessionController

    def say(line: str) -> None:
        print(line, flush=True)

    address.check()
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
    side = request.check()
    if options.side is None:
        options = replace(options, side=side)
    desk = SessionController(_flight(options, trial.rehearse, folder))
    result = run_console(address, folder, desk, request, say)
    say(f"Ended. Diary of the pages: {result.diary}")
    return result
