"""Datagram of the aircraft: ten ASCII fields, separated by semicolons. Any other content is rejected."""

import math
import re
from dataclasses import dataclass

PORT = 3131
RATE_HZ = 10.0
DAY_MS = 86_400_000
SIZE_MAX_BYTES = 400
"""Upper limit of a datagram's size. A normal line has about 100 bytes."""

NUMBER = re.compile(r"[+-]?\d{1,9}(\.\d{1,9})?")
WHOLE = re.compile(r"\d{1,8}")
CLOCK = re.compile(r"\d{1,2}:\d{1,2}(\.\d{1,3})?")
TEXT = re.compile(r"[ -~]{0,60}")
G_MAX = 10.0


@dataclass(frozen=True)
class AircraftSample:
    """Sample of the aircraft's data feed. Source: docs/explanation/task.md."""

    since_midnight_ms: int
    clock: str
    """Minutes and seconds, as sent."""

    g: tuple[float, float, float]
    """Acceleration along the aircraft's axes [g]."""

    temperature_C: float
    humidity_percent: float
    pressure_mbar: float
    parabola: int
    """Number of the parabola; 0 before the first one."""

    announcement: str
    """Text as sent. The protocol defines its meaning."""

    @property
    def norm_g(self) -> float:
        """Norm of the measured acceleration [g].

        The sensor has the aircraft's axes, and the aircraft is never exactly level.
        """
        return math.hypot(*self.g)

    @property
    def message(self) -> dict[str, object]:
        """Message of the sample on the channel `/aircraft` of a recording."""
        return {"g": list(self.g), "parabola": self.parabola, "announcement": self.announcement}


def parse_line(datagram: bytes) -> AircraftSample | str:
    """Sample in a datagram, or the reason why the datagram is rejected."""
    if len(datagram) > SIZE_MAX_BYTES:
        return f"{len(datagram)} bytes; allowed: at most {SIZE_MAX_BYTES}"
    try:
        fields = datagram.decode("ascii").strip("\r\n").split(";")
    except UnicodeDecodeError:
        return "not ASCII"
    if len(fields) == 11 and not fields[-1].strip():
        fields.pop()  # The line ended with a semicolon.
    if len(fields) != 10:
        return f"{len(fields)} fields instead of 10"
    time_ms, clock, *middle, parabola, announcement = (field.strip() for field in fields)
    for name, value, form in (
        ("time", time_ms, WHOLE),
        ("clock", clock, CLOCK),
        ("parabola", parabola, WHOLE),
        ("announcement", announcement, TEXT),
        *((name, value, NUMBER) for name, value in zip(NAMES, middle, strict=True)),
    ):
        if not form.fullmatch(value):
            return f"{name} is {value[:40]!r}"
    x, y, z, temperature, humidity, pressure = map(float, middle)
    if int(time_ms) >= DAY_MS or int(parabola) > 999 or max(abs(x), abs(y), abs(z)) > G_MAX:
        return f"time {time_ms} ms, parabola {parabola} or g {x:g} {y:g} {z:g} is out of range"
    return AircraftSample(int(time_ms), clock, (x, y, z), temperature, humidity, pressure, int(parabola), announcement)


NAMES = ("Jx", "Jy", "Jz", "temperature", "humidity", "pressure")


def line_of(sample: AircraftSample) -> bytes:
    """Datagram of a sample, as the emulator sends it."""
    jx, jy, jz = sample.g
    fields = (
        str(sample.since_midnight_ms),
        sample.clock,
        f"{jx:.6f}",
        f"{jy:.6f}",
        f"{jz:.6f}",
        f"{sample.temperature_C:g}",
        f"{sample.humidity_percent:g}",
        f"{sample.pressure_mbar:g}",
        str(sample.parabola),
        sample.announcement,
    )
    return ";".join(fields).encode("ascii")


def clock_of(since_midnight_ms: int) -> str:
    """Minutes of the hour and seconds, as text."""
    minutes, ms = divmod(since_midnight_ms % 3_600_000, 60_000)
    return f"{minutes:02d}:{ms / 1000:04.1f}"


def newer_by_ms(later: int, earlier: int) -> int:
    """Time from `earlier` to `later`, both since midnight [ms]; negative if `later` is before.

    Midnight may lie between.
    """
    return (later - earlier + DAY_MS // 2) % DAY_MS - DAY_MS // 2
