"""`exograv console`."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common

if TYPE_CHECKING:
    from exograv.experiment.steered.interface import SteeredFlight


@dataclass(frozen=True)
class Console(Common):
    """Pages for operator, therapist, participant and viewers of a live machine; prints one link, to be opened once."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    calibration: Path | None = None
    """calibration.toml of this machine; it is calibrated at the beginning where none is named, which takes a minute."""

    participants: Path | None = None
    """Folder of people's files: who is in it is only checked, 20 s instead of 60; who is learned is written there."""

    participant: str | None = None
    """Code of whoever is in the machine at the beginning, such as P-07, never a name."""

    identify: Annotated[float, tyro.conf.arg(metavar="S")] = 60.0
    """Of motion, for somebody who is not known."""

    donning: int = 0
    """Number of the day on which the virtual person is in the machine."""

    on_loss: Literal["finish", "stop"] = "finish"
    """What becomes of an open window when nobody steers any more."""

    protocol: str | None = None
    """What the participant does: training, familiarisation, flight, or the path of a file. Without one the machine is
    only steered."""

    aircraft: Annotated[tuple[int, ...] | None, tyro.conf.arg(metavar="[PORT]")] = None
    """Hear the aircraft on this UDP port (3131 if none is given): its g opens and closes windows."""

    aircraft_sender: str | None = None
    """Only address that is believed."""

    session: int = 1
    """Which one of this protocol it is for this person; it names the file in which the run is kept."""

    resume: bool = False
    """Go on with a run that was broken off, at the next window."""

    port: int = 8088
    """TCP port on this computer; 0 takes a free one."""

    browser: bool = True
    """Open the link in this computer's browser."""

    rehearse: bool = False
    """No machine at all, not even the twin: to show and try the pages."""

    lan: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Serve tablets too: the address or name by which they reach this computer. Needs a certificate."""

    certificate: Path | None = None
    """Of TLS, as PEM, with `--lan`."""

    key: Path | None = None
    """Its private key."""


def _flight(command: Console) -> "SteeredFlight":
    from exograv.experiment.steered.live_session import LiveFlight
    from exograv.experiment.steered.options import SteeredOptions
    from exograv.experiment.steered.rehearsal import RehearsedFlight

    if command.rehearse:
        return RehearsedFlight(side=command.side or "right")
    options = SteeredOptions(
        rig=command.rig,
        side=command.side,
        level=command.level,
        seed=command.seed,
        donning=command.donning,
        calibration=command.calibration,
        participants=command.participants,
        participant=command.participant,
        identify_s=command.identify,
        on_loss=command.on_loss,
    )
    return LiveFlight(options, command.out)


def _port(given: tuple[int, ...]) -> int:
    from exograv.errors import ConfigError
    from exograv.task.aircraft_line import PORT

    if len(given) > 1:
        raise ConfigError(f"--aircraft is {' '.join(map(str, given))}; give one port, or none for {PORT}.")
    return given[0] if given else PORT


def run_console_command(command: Console) -> dict[str, Any]:
    """Serve until Ctrl-C."""
    from exograv.console.feed import receiver_of
    from exograv.console.run import ConsoleOptions, plan_of, run_console
    from exograv.console.run_checkpoint import kept_run
    from exograv.console.serve import Address
    from exograv.experiment.steered.session_controller import SessionController

    def say(line: str) -> None:
        print(line, flush=True)

    address = Address(command.port, command.lan, command.certificate, command.key)
    address.check()
    plan = plan_of(command.protocol)
    receiver = None if command.aircraft is None else receiver_of(plan, _port(command.aircraft), command.aircraft_sender)
    rig = "rehearsal" if command.rehearse else command.rig
    kept = kept_run(command.out, command.protocol, command.participant, command.session, rig, command.resume)
    if kept is not None and command.side is None:
        command = replace(command, side=kept.circumstances.side)
    desk = SessionController(_flight(command))
    options = ConsoleOptions(address, command.out, command.browser)
    result = run_console(options, desk, plan, say, kept, receiver)
    say(f"Ended. What the pages did: {result['diary']}")
    return result
