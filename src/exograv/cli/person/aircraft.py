"""`exograv aircraft`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import tyro

from exograv.cli.shell.base_options import Common

if TYPE_CHECKING:
    from exograv.experiment.aircraft import HeardAircraft


@dataclass(frozen=True)
class Aircraft:
    """Options of `exograv aircraft`."""

    what: tyro.conf.Positional[Literal["listen", "emulate"]] = "listen"
    """Hear what is sent and say when windows open; or send an emulated flight."""

    protocol: str = "flight"
    """Whose windows and limits are heard for: a name, or the path of a file."""

    port: int = 3131
    """UDP port."""

    host: str = "127.0.0.1"
    """To whom an emulated flight is sent; a broadcast address for a whole network."""

    sender: str | None = None
    """Only address that is believed when listening."""

    seconds: float = 86_400.0
    """How long to listen."""

    parabolas: int = 31
    """Of the emulated flight."""

    level: float = 0.0
    """Of its parabolas: 0 weightless, 0.16 Moon, 0.38 Mars."""

    speed: float = 1.0
    """Of its time; 60 flies a minute in a second, and is not to be listened to."""

    loss: float = 0.0
    """Share of its datagrams that are lost."""

    jitter_ms: float = 0.0
    """Mean delay of its datagrams."""


def run_aircraft_command(command: Aircraft, common: Common) -> "HeardAircraft | dict[str, int | None]":
    """The live data of an aircraft in parabolic flight: hear them, or send such data on the ground."""
    from pydantic import ValidationError

    from exograv.errors import ConfigError
    from exograv.experiment.aircraft import AircraftReceiver, Emulation, emulate, listen
    from exograv.model.description import validation_sentences
    from exograv.task.flight_profile import FlightProfile, Network
    from exograv.task.protocol import load_protocol

    def say(line: str) -> None:
        print(line, flush=True)

    if not 1 <= command.port <= 65535:
        raise ConfigError(f"--port is {command.port}; allowed: 1 to 65535.")
    if command.what == "listen":
        settings = load_protocol(command.protocol).settings
        level = settings.windows.levels[0].start
        receiver = AircraftReceiver(settings.aircraft, level, command.port, command.sender)
        return listen(receiver, command.seconds, say)
    try:
        profile = FlightProfile(parabolas=command.parabolas, level=command.level)
        network = Network(loss=command.loss, jitter_s=1e-3 * command.jitter_ms)
    except ValidationError as error:
        raise ConfigError(
            f"The emulated flight cannot be: {validation_sentences(error)} Correct the option."
        ) from error
    try:
        sent = emulate(Emulation(profile, network, command.host, command.port, command.speed, common.seed), say)
    except KeyboardInterrupt:
        say("Ended by the keyboard.")
        return {"sent": None}
    return {"sent": sent}
