"""Command `exograv data aircraft`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import tyro

from exograv.options import SeedOption

if TYPE_CHECKING:
    from exograv.experiment.aircraft import HeardAircraft


@dataclass(frozen=True)
class Aircraft:
    """Options of `exograv data aircraft`."""

    what: tyro.conf.Positional[Literal["listen", "emulate"]] = "listen"
    """Listen to the data and show when windows open, or send an emulated flight."""

    protocol: str = "flight"
    """Protocol with the windows and limits: a name, or the path of a file."""

    port: int = 3131
    """UDP port."""

    host: str = "127.0.0.1"
    """Destination of an emulated flight; a broadcast address reaches a whole network."""

    sender: str | None = None
    """IPv4 address of the only sender that is accepted when listening."""

    seconds: float = 86_400.0
    """Time to listen [s]."""

    parabolas: int = 31
    """Number of parabolas of the emulated flight."""

    level: float = 0.0
    """Gravity level of the emulated parabolas: 0 weightless, 0.16 Moon, 0.38 Mars."""

    speed: float = 1.0
    """Speed of the emulated flight: 60 sends a minute in a second, which a receiver cannot use."""

    loss: float = 0.0
    """Share of the emulated datagrams that are lost."""

    jitter_ms: float = 0.0
    """Mean delay of the emulated datagrams [ms]."""


def run_aircraft_command(command: Aircraft, drawn: SeedOption) -> "HeardAircraft | dict[str, int | None]":
    """Listen to the live data of an aircraft in parabolic flight, or send such data on the ground."""
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
            f"The emulated flight is not possible: {validation_sentences(error)} Correct the option."
        ) from error
    try:
        sent = emulate(Emulation(profile, network, command.host, command.port, command.speed, drawn.seed), say)
    except KeyboardInterrupt:
        say("Ended by the keyboard.")
        return {"sent": None}
    return {"sent": sent}
