"""Command `exograv data aircraft`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from exograv.options import Acts, Seed

if TYPE_CHECKING:
    from exograv.experiment.aircraft import HeardAircraft


LISTENING = Acts(lambda all_: all_.what == "listen", "in `exograv data aircraft listen`")
EMULATING = Acts(lambda all_: all_.what == "emulate", "in `exograv data aircraft emulate`")


@dataclass(frozen=True)
class Aircraft:
    """Options of `exograv data aircraft`."""

    what: tyro.conf.Positional[Literal["listen", "emulate"]] = "listen"
    """Listen to the data and show when windows open, or send an emulated flight."""

    protocol: Annotated[str, LISTENING] = "flight"
    """Protocol with the windows and limits: a name, or the path of a file."""

    port: int = 3131
    """UDP port."""

    host: Annotated[str, EMULATING] = "127.0.0.1"
    """Destination of an emulated flight; a broadcast address reaches a whole network."""

    sender: Annotated[str | None, LISTENING] = None
    """IPv4 address of the only sender that is accepted when listening."""

    seconds: Annotated[float, LISTENING] = 86_400.0
    """Time to listen [s]."""

    parabolas: Annotated[int, EMULATING] = 31
    """Number of parabolas of the emulated flight."""

    level: Annotated[float, EMULATING] = 0.0
    """Gravity level of the emulated parabolas: 0 weightless, 0.165 Moon, 0.38 Mars."""

    speed: Annotated[float, EMULATING] = 1.0
    """Speed of the emulated flight: 60 sends a minute in a second, which a receiver cannot use."""

    loss: Annotated[float, EMULATING] = 0.0
    """Share of the emulated datagrams that are lost."""

    jitter_ms: Annotated[float, EMULATING] = 0.0
    """Mean delay of the emulated datagrams [ms]."""

    seed: Annotated[Seed, EMULATING, tyro.conf.arg(help="Seed of losses and delays of the emulated datagrams.")] = 0


def run_aircraft_command(command: Aircraft) -> "HeardAircraft | dict[str, int | None]":
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
        sent = emulate(Emulation(profile, network, command.host, command.port, command.speed, command.seed), say)
    except KeyboardInterrupt:
        say("Ended by the keyboard.")
        return {"sent": None}
    return {"sent": sent}
