"""The aircraft's data from the network, and emulated or recorded flights that are sent on the ground."""

import socket
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import IPv4Address
from types import TracebackType

from exograv.errors import ConfigError
from exograv.task.aircraft_line import PORT, SIZE_MAX_BYTES, AircraftSample, line_of, parse_line
from exograv.task.aircraft_watch import AircraftEvent, AircraftWatch
from exograv.task.events import FeedBack, FeedLost, OpenWindow
from exograv.task.flight_profile import FlightProfile, Network, datagrams, samples
from exograv.task.task_settings import AircraftSettings

from .sensor_file.load import LoadedFlight

AT_ONCE_MAX = 64
"""Largest number of datagrams per call. A flooded port must not delay the clock."""

CHECK_S = 0.02
Say = Callable[[str], None]


class AircraftReceiver:
    """Receiver of the aircraft's data on a UDP port. It reports when windows open and close."""

    def __init__(self, settings: AircraftSettings, level: float, port: int = PORT, sender: str | None = None):
        """Set up the receiver. The port is opened by `with`.

        Args:
            settings: Aircraft settings of the protocol.
            level: Gravity level of the windows in this flight [-].
            port: UDP port; 0 takes a free one.
            sender: Only accepted sender address; any sender if absent.

        Raises:
            ConfigError: The sender is not an IPv4 address, so that no datagram would ever be accepted.
        """
        if sender is not None:
            try:
                sender = str(IPv4Address(sender))
            except ValueError as error:
                raise ConfigError(
                    f"--sender is '{sender}'; give the IPv4 address from which the aircraft's data come, such as "
                    "192.168.1.20, or omit it."
                ) from error
        self._watch, self._port, self._sender = AircraftWatch(settings, level), port, sender
        self._socket: socket.socket | None = None
        self.heard = self.refused = self.foreign = 0
        self.why_refused = ""
        """Reason of the latest rejection."""
        self.told: Callable[[float, AircraftSample], None] = lambda _t, _sample: None
        """Callback for every sample, with its time of arrival [s]."""

    def __enter__(self) -> "AircraftReceiver":
        """Open the port.

        Raises:
            ConfigError: The port is not available.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # The datagrams are a broadcast: another program on this computer may receive them too.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setblocking(False)
        try:
            self._socket.bind(("", self._port))
        except OSError as error:
            self._socket.close()
            raise ConfigError(
                f"UDP port {self._port} is not available: {error.strerror}. Give another --port, or end the "
                "program that uses it."
            ) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the UDP port."""
        if self._socket is not None:
            self._socket.close()

    @property
    def port(self) -> int:
        """UDP port in use."""
        return self._port if self._socket is None else self._socket.getsockname()[1]

    @property
    def sample(self) -> AircraftSample | None:
        """Newest sample of the aircraft; None before the first."""
        return self._watch.last

    @property
    def is_window(self) -> bool:
        """True if g is that of a window."""
        return self._watch.is_window

    @property
    def is_lost(self) -> bool:
        """True if no sample has arrived for too long, after at least one."""
        return self._watch.is_lost

    def receive(self, t: float) -> tuple[AircraftEvent, ...]:
        """Process datagrams until `t` on the caller's clock [s]. Return the events, also that of a lost feed."""
        events = list[AircraftEvent]()
        for _ in range(AT_ONCE_MAX):
            datagram = self._next()
            if datagram is None:
                break
            sample = parse_line(datagram)
            if isinstance(sample, str):
                self.refused, self.why_refused = self.refused + 1, sample
                continue
            self.heard += 1
            self.told(t, sample)
            self._watch, more = self._watch.with_sample(sample, t)
            events += more
        self._watch, more = self._watch.at(t)
        return (*events, *more)

    def _next(self) -> bytes | None:
        while self._socket is not None:
            try:
                datagram, (address, _) = self._socket.recvfrom(SIZE_MAX_BYTES + 1)
            except BlockingIOError:
                return None
            if self._sender in (None, address):
                return datagram
            self.foreign += 1
        return None


@dataclass(frozen=True)
class Destination:
    """Receiver of a flight on the network, and the pace."""

    host: str = "127.0.0.1"
    """Address of the receiver, or a broadcast address for a whole network."""
    port: int = PORT
    speed: float = 1.0
    """Factor of time: 60 sends a minute of flight in one second."""

    def minutes(self, seconds: float) -> float:
        """Duration of the transmission of a flight of this duration [min].

        Raises:
            ConfigError: The speed is not valid.
        """
        if not 0.01 <= self.speed <= 1000.0:
            raise ConfigError(f"--speed is {self.speed:g}; allowed: 0.01 to 1000.")
        return seconds / 60.0 / self.speed


@dataclass(frozen=True)
class Emulation:
    """Emulated flight on the network."""

    profile: FlightProfile
    network: Network
    where: Destination = Destination()
    seed: int = 0


def emulate(emulation: Emulation, say: Say) -> int:
    """Send an emulated flight, and return the number of datagrams.

    Raises:
        ConfigError: An option is not valid, or the address cannot be reached.
    """
    profile, where = emulation.profile, emulation.where
    minutes = where.minutes(profile.cycle_s * profile.parabolas)
    say(f"Emulated flight: {profile.parabolas} parabolas to {where.host}:{where.port}, {minutes:.1f} min.")
    return send(datagrams(samples(profile, emulation.seed), emulation.network, emulation.seed), where)


def replay(flight: LoadedFlight, where: Destination, say: Say) -> int:
    """Send a recorded flight, and return the number of datagrams.

    Raises:
        ConfigError: An option is not valid, or the address cannot be reached.
    """
    minutes = where.minutes(flight.samples[-1][0])
    say(
        f"Recorded flight to {where.host}:{where.port}, {minutes:.1f} min; {flight.refused} rows of the file cannot "
        f"be used, {flight.gaps} gaps stay gaps."
    )
    return send(((t, line_of(sample)) for t, sample in flight.samples), where)


def send(sent: Iterable[tuple[float, bytes]], where: Destination) -> int:
    """Send datagrams at their times [s], and return their number.

    Raises:
        ConfigError: The address cannot be reached.
    """
    count, begun = 0, time.monotonic()
    with sender_to(where) as send_now:
        for arrives, datagram in sent:
            wait_s = begun + arrives / where.speed - time.monotonic()
            if wait_s > 0.0:
                time.sleep(wait_s)
            send_now(datagram)
            count += 1
    return count


@contextmanager
def sender_to(where: Destination) -> Iterator[Callable[[bytes], None]]:
    """Open a socket, and give the function that sends one datagram.

    Raises:
        ConfigError: The address cannot be reached.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

        def send_now(datagram: bytes) -> None:
            try:
                sender.sendto(datagram, (where.host, where.port))
            except OSError as error:
                raise ConfigError(
                    f"Datagrams cannot be sent to {where.host}:{where.port}: {error.strerror}. Give another --host or "
                    "--port."
                ) from error

        yield send_now


@dataclass(frozen=True)
class HeardAircraft:
    """Result of `exograv data aircraft listen`."""

    heard: int
    refused: int
    """Datagrams that are not valid aircraft data."""
    why_refused: str
    from_others: int
    """Datagrams of other senders."""
    windows: int
    parabola: int | None
    announcement: str | None


def listen(receiver: AircraftReceiver, seconds: float, say: Say) -> HeardAircraft:
    """Receive the aircraft's data for a time [s], or until Ctrl-C.

    Raises:
        ConfigError: The port is not available, or the time is not valid.
    """
    if not 0.0 < seconds <= 86_400.0:
        raise ConfigError(f"--seconds is {seconds:g}; allowed: above 0, at most 86400 (one day).")
    windows, begun = 0, time.monotonic()
    with receiver:
        say(f"Listening on UDP port {receiver.port}; Press Ctrl-C to end.")
        try:
            while (t := time.monotonic() - begun) < seconds:
                for event in receiver.receive(t):
                    windows += isinstance(event, OpenWindow)
                    say(f"{t:8.1f} s  {sentence(event)}")
                time.sleep(CHECK_S)
        except KeyboardInterrupt:
            say("Ended by Ctrl-C.")
    heard, last = (receiver.heard, receiver.refused, receiver.why_refused, receiver.foreign), receiver.sample
    return HeardAircraft(*heard, windows, last and last.parabola, last and last.announcement)


def sentence(event: AircraftEvent) -> str:
    """Sentence about an event for the terminal."""
    if isinstance(event, OpenWindow):
        says = {None: "announcement unknown", True: "the announcement agrees", False: "the announcement contradicts"}
        return f"window opens, parabola {event.parabola}, {says[event.confirmed]}"
    if isinstance(event, FeedLost):
        return "no data arrive any more"
    return "data arrive again" if isinstance(event, FeedBack) else "window closes"
