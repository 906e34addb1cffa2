"""Command `exograv data aircraft`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from exograv.options import Acts, Seed

if TYPE_CHECKING:
    from exograv.experiment.aircraft import Destination, HeardAircraft
    from exograv.experiment.sensor_file.load import LoadedFlight
    from exograv.experiment.sensor_stream import Relayed
    from exograv.task.task_settings import AircraftSettings


LISTENING = Acts(lambda all_: all_.what == "listen", "in `exograv data aircraft listen`")
REPLAYING = Acts(lambda all_: all_.what == "replay", "in `exograv data aircraft replay`")
READING = Acts(lambda all_: all_.what in ("replay", "relay"), "in `exograv data aircraft replay` and `relay`")
SENDING = Acts(lambda all_: all_.what != "listen", "in `exograv data aircraft emulate`, `replay` and `relay`")
PACED = Acts(lambda all_: all_.what in ("emulate", "replay"), "in `exograv data aircraft emulate` and `replay`")
JUDGING = Acts(lambda all_: all_.what != "emulate", "in `exograv data aircraft listen`, `replay` and `relay`")
TIMED = Acts(lambda all_: all_.what in ("listen", "relay"), "in `exograv data aircraft listen` and `relay`")
EMULATING = Acts(lambda all_: all_.what == "emulate", "in `exograv data aircraft emulate`")


@dataclass(frozen=True)
class Aircraft:
    """Options of `exograv data aircraft`."""

    what: tyro.conf.Positional[Literal["listen", "emulate", "replay", "relay"]] = "listen"
    """Listen to the data and show when windows open, or send an emulated flight, one that a sensor recorded, or the
    present acceleration of a sensor on Lab Streaming Layer."""

    protocol: Annotated[str, JUDGING] = "flight"
    """Protocol with the windows and limits: a name, or the path of a file."""

    port: int = 3131
    """UDP port."""

    host: Annotated[str, SENDING] = "127.0.0.1"
    """Destination of the flight; a broadcast address reaches a whole network."""

    sender: Annotated[str | None, LISTENING] = None
    """IPv4 address of the only sender that is accepted when listening."""

    seconds: Annotated[float, TIMED] = 86_400.0
    """Time to listen or to relay [s]."""

    file: Annotated[Path | None, REPLAYING] = None
    """Recorded acceleration of a flight: a table as text (CSV), the aircraft's own lines, sentences of a VectorNav
    sensor, a stream of an XDF file, or a matrix of a MATLAB file."""

    columns: Annotated[tuple[str, ...], READING, tyro.conf.arg(metavar="TIME X Y Z")] = ()
    """Columns of the file, or channels X Y Z of the stream, by name or by number from 1; without them the names
    decide."""

    unit: Annotated[Literal["g", "mg", "m/s2"] | None, READING] = None
    """Unit of the acceleration, if the file or the stream does not state it."""

    time_unit: Annotated[Literal["s", "ms", "us", "ns"] | None, REPLAYING] = None
    """Unit of the time, if the file does not state it."""

    rate: Annotated[float | None, REPLAYING] = None
    """Rate of the sensor, if the file holds no times [Hz]."""

    stream: Annotated[str | None, READING] = None
    """Stream of an XDF file, or variable of a MATLAB file, with the acceleration; for `relay`, name or type of the
    stream on Lab Streaming Layer."""

    parabolas: Annotated[int, EMULATING] = 31
    """Number of parabolas of the emulated flight."""

    level: Annotated[float, EMULATING] = 0.0
    """Gravity level of the emulated parabolas: 0 weightless, 0.165 Moon, 0.38 Mars."""

    speed: Annotated[float, PACED] = 1.0
    """Speed of the flight: 60 sends a minute in a second, which a receiver cannot use."""

    loss: Annotated[float, EMULATING] = 0.0
    """Share of the emulated datagrams that are lost."""

    jitter_ms: Annotated[float, EMULATING] = 0.0
    """Mean delay of the emulated datagrams [ms]."""

    seed: Annotated[Seed, EMULATING, tyro.conf.arg(help="Seed of losses and delays of the emulated datagrams.")] = 0


def run_aircraft_command(command: Aircraft) -> "HeardAircraft | Relayed | dict[str, int | None]":
    """Listen to the data of an aircraft in parabolic flight, or send a flight: emulated, recorded, or of a sensor."""
    from exograv.errors import ConfigError
    from exograv.experiment.aircraft import AircraftReceiver, listen, replay

    if not 1 <= command.port <= 65535:
        raise ConfigError(f"--port is {command.port}; allowed: 1 to 65535.")
    if command.what == "listen":
        settings, level = _limits(command)
        return listen(AircraftReceiver(settings, level, command.port, command.sender), command.seconds, _say)
    if command.what == "relay":
        return _relayed(command)
    try:
        return (
            {"sent": replay(_recorded(command), _destination(command), _say)}
            if command.what == "replay"
            else {"sent": _emulated(command)}
        )
    except KeyboardInterrupt:
        _say("Ended by the keyboard.")
        return {"sent": None}


def _say(line: str) -> None:
    print(line, flush=True)


def _limits(command: Aircraft) -> "tuple[AircraftSettings, float]":
    """Return the limits of the protocol, and the level of its windows."""
    from exograv.task.protocol import load_protocol

    settings = load_protocol(command.protocol).settings
    return settings.aircraft, settings.windows.levels[0].start


def _destination(command: Aircraft) -> "Destination":
    from exograv.experiment.aircraft import Destination

    return Destination(command.host, command.port, command.speed)


def _recorded(command: Aircraft) -> "LoadedFlight":
    """Load the flight of a file.

    Raises:
        ConfigError: No file is given, or an option about it is not valid.
    """
    from exograv.errors import ConfigError
    from exograv.experiment.sensor_file.load import SensorFile, load_flight
    from exograv.experiment.sensor_file.table import Names

    if command.file is None:
        raise ConfigError("Give the file of the recorded acceleration with --file.")
    if len(command.columns) not in (0, 3, 4):
        raise ConfigError(f"--columns names {len(command.columns)} columns; give TIME X Y Z, or X Y Z with --rate.")
    if command.rate is not None and not 0.0 < command.rate <= 1e5:
        raise ConfigError(f"--rate is {command.rate:g} Hz; allowed: above 0, at most 100000.")
    names = Names(command.columns, command.unit, command.time_unit, command.rate)
    return load_flight(SensorFile(command.file, names, command.stream), *_limits(command))


def _relayed(command: Aircraft) -> "Relayed":
    """Send the acceleration of a stream.

    Raises:
        ConfigError: No stream is given or found, an option about it is not valid, or LSL is not installed.
    """
    from exograv.errors import ConfigError
    from exograv.experiment.sensor_file.table import Names
    from exograv.runtime.lsl.library import require_lsl

    require_lsl()
    if not command.stream:
        raise ConfigError("Name the stream of the acceleration with --stream; `exograv data streams` lists all.")
    if len(command.columns) not in (0, 3):
        raise ConfigError(f"--columns names {len(command.columns)} channels; a stream needs three: X Y Z.")
    if not 0.0 < command.seconds <= 86_400.0:
        raise ConfigError(f"--seconds is {command.seconds:g}; allowed: above 0, at most 86400 (one day).")
    from exograv.experiment.sensor_stream import SensorStream, relay

    stream = SensorStream(command.stream, Names(command.columns, command.unit))
    return relay(stream, *_limits(command), _destination(command), command.seconds, _say)


def _emulated(command: Aircraft) -> int:
    """Send an emulated flight, and return the number of datagrams.

    Raises:
        ConfigError: The flight is not possible, or the address cannot be reached.
    """
    from pydantic import ValidationError

    from exograv.errors import ConfigError
    from exograv.experiment.aircraft import Emulation, emulate
    from exograv.model.description import validation_sentences
    from exograv.task.flight_profile import FlightProfile, Network

    try:
        profile = FlightProfile(parabolas=command.parabolas, level=command.level)
        network = Network(loss=command.loss, jitter_s=1e-3 * command.jitter_ms)
    except ValidationError as error:
        raise ConfigError(
            f"The emulated flight is not possible: {validation_sentences(error)} Correct the option."
        ) from error
    return emulate(Emulation(profile, network, _destination(command), command.seed), _say)
