"""How well the streams of other devices are tied to the robot's clock, and what is missing of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.clock_fit import ClockFit, fit_clock
from exograv.errors import RecordingError
from exograv.recording import Recording
from exograv.recording.device_stream import DeviceStream

GAP_PERIODS = 2.0
"""An interval longer than so many nominal periods is a gap."""

GAPS_SHOWN = 100

SEGMENT = 10
"""Samples without a gap, from which on jitter is told."""

ARRIVAL_S = (-0.005, 5.0)
"""Between a stamp, corrected, and its arrival. Outside of that the device does not stamp by LSL's clock: nothing comes
before it was measured, but for what the correction is wrong by."""

RATE_SHARE = 0.01
"""A rate that differs more from the nominal one is remarked on."""

Samples = Float[np.ndarray, " sample"]


@dataclass(frozen=True)
class Percentiles:
    """Of arrivals after their stamps."""

    min: float
    p50: float
    max: float


@dataclass(frozen=True)
class Jitter:
    """Stamps about a straight line through those between two gaps [µs]."""

    sd: float
    p99: float
    max: float


@dataclass(frozen=True)
class Scatter:
    """Of the robot's clock about a straight line [µs]."""

    p50: float
    p99: float
    max: float


@dataclass(frozen=True)
class ResidualFigures:
    """Of corrections about the fit [µs]."""

    p50: float
    max: float


@dataclass(frozen=True)
class Gap:
    """Samples that are missing by the nominal rate."""

    t: float
    """Of the last sample before."""

    seconds: float
    """To the next sample."""

    samples: int


@dataclass(frozen=True)
class ClockFigures:
    """Clock of one connection against the computer's."""

    connection: int
    asked: int
    measured: int
    offset_ms: float
    offset_ci95_ms: tuple[float, float] | None
    drift_ppm: float | None
    drift_ci95_ppm: tuple[float, float] | None
    residual_us: ResidualFigures
    round_trip_us: float
    certain_to_us: float | None


@dataclass(frozen=True)
class StreamSync:
    """Figures of one stream; times are of the robot's clock where they are named `t`."""

    name: str
    type: str
    topic: str
    values: str
    channels: int
    samples: int
    nominal_rate_Hz: float
    effective_rate_Hz: float | None
    jitter_us: Jitter | None
    gaps_total: int
    gaps: Sequence[Gap]
    """First gaps."""

    backward_stamps: int
    connections: int
    lost: int
    silent: int
    clocks: list[ClockFigures]
    arrival_ms: Percentiles | None
    certain_to_us: float | None
    """None where the device does not stamp by LSL's clock, or nothing was measured."""

    remarks: list[str]


@dataclass(frozen=True)
class RobotSync:
    """The rig's clock against CLOCK_MONOTONIC."""

    ticks: int
    drift_ppm: float | None
    scatter_us: Scatter


@dataclass(frozen=True)
class SyncResult:
    """Figures of `exograv data sync`."""

    recording: Path
    remark: str | None
    robot: RobotSync | None
    """None without a robot, or on a virtual clock."""

    streams: list[StreamSync]


def sync_figures(recording: Recording) -> SyncResult:
    """Measure how the streams of a recording are tied to the robot's clock.

    Raises:
        RecordingError: The recording holds no stream of another device.
    """
    if not recording.streams:
        raise RecordingError(
            f"{recording.path} holds no stream of another device. Record one with "
            "`exograv run live --record-stream NAME` or `exograv data streams --record NAME`."
        )
    streams = [stream_figures(stream) for stream in recording.streams]
    return SyncResult(recording.path, recording.remark, _robot(recording), streams)


def stream_figures(stream: DeviceStream) -> StreamSync:
    """Measure one stream."""
    rhythm = Rhythm.of(stream)
    clocks = [_clock(stream, number, fit) for number, fit in stream.clocks.items()]
    arrival = stream.received - stream.monotonic
    arrival = arrival[np.isfinite(arrival)]
    is_foreign = bool(len(arrival)) and not ARRIVAL_S[0] <= float(np.median(arrival)) <= ARRIVAL_S[1]
    certain = [clock.certain_to_us for clock in clocks if clock.certain_to_us is not None]
    kinds = [note.kind for note in stream.notes]
    return StreamSync(
        name=stream.name,
        type=stream.kind,
        topic=stream.topic,
        values=stream.value_type,
        channels=stream.channels,
        samples=len(stream.stamps),
        nominal_rate_Hz=stream.nominal_rate_Hz,
        effective_rate_Hz=rhythm.rate_Hz,
        jitter_us=rhythm.jitter_us,
        gaps_total=len(rhythm.gaps),
        gaps=rhythm.gaps[:GAPS_SHOWN],
        backward_stamps=rhythm.backward,
        connections=kinds.count("connected"),
        lost=kinds.count("lost"),
        silent=kinds.count("silent"),
        clocks=clocks,
        arrival_ms=Percentiles(*_percentiles(1e3 * arrival, (0, 50, 100), 3)) if len(arrival) else None,
        certain_to_us=None if is_foreign or not certain else max(certain),
        remarks=_remarks(stream, rhythm, arrival if is_foreign else None),
    )


@dataclass(frozen=True)
class Rhythm:
    """How regularly a stream came, by its stamps on the computer's clock, or its own where that is unknown."""

    rate_Hz: float | None
    """Without gaps and reconnections."""

    jitter_us: Jitter | None
    """None of a stream without a rate."""

    gaps: list[Gap]

    backward: int
    """Stamps that are older than the one before."""

    @classmethod
    def of(cls, stream: DeviceStream) -> "Rhythm":
        """A stream's."""
        known = np.isfinite(stream.monotonic)
        stamps = np.where(known, stream.monotonic, stream.stamps)
        t = np.where(known, stream.t, stream.stamps)
        interval, same = np.diff(stamps), np.diff(stream.connection) == 0
        backward = int(np.count_nonzero(interval[same] < 0.0))
        nominal = stream.nominal_rate_Hz
        if not nominal:
            return cls(None, None, [], backward)
        is_gap = same & (interval > GAP_PERIODS / nominal)
        gaps = [Gap(float(t[k]), float(interval[k]), round(interval[k] * nominal) - 1) for k in np.flatnonzero(is_gap)]
        going = interval[same & ~is_gap]
        rate = len(going) / float(going.sum()) if len(going) and going.sum() > 0.0 else None
        parts = np.split(stamps, np.flatnonzero(is_gap | ~same) + 1)
        return cls(rate, _jitter_us(parts), gaps, backward)


def _jitter_us(parts: list[np.ndarray]) -> Jitter | None:
    residuals = [_about_line(part) for part in parts if len(part) >= SEGMENT]
    if not residuals:
        return None
    away = 1e6 * np.abs(np.concatenate(residuals))
    return Jitter(round(float(np.sqrt(np.mean(away**2))), 3), *_percentiles(away, (99, 100), 3))


def _about_line(values: Samples) -> Samples:
    index = np.arange(len(values)) - (len(values) - 1) / 2
    values = values - values.mean()
    return values - index * (index @ values) / (index @ index)


def _clock(stream: DeviceStream, number: int, fit: ClockFit) -> ClockFigures:
    of = [one for one in stream.corrections if one.connection == number]
    round_trip = float(np.median([one.uncertainty for one in of]))
    remote = np.array([one.remote for one in of])
    away = np.abs(fit.residual)
    return ClockFigures(
        connection=number,
        asked=len(of),
        measured=len(fit.residual),
        offset_ms=1e3 * fit.offset,
        offset_ci95_ms=_scaled(fit.offset_ci95, 1e3),
        drift_ppm=1e6 * fit.drift if fit.has_drift else None,
        drift_ci95_ppm=_scaled(fit.drift_ci95, 1e6),
        residual_us=ResidualFigures(1e6 * float(np.median(away)), 1e6 * float(away.max())),
        round_trip_us=1e6 * round_trip,
        certain_to_us=_certain_us(fit, round_trip, float(np.ptp(remote))),
    )


def _certain_us(fit: ClockFit, round_trip: float, span: float) -> float | None:
    """Half the round trip, which no repetition makes smaller (the ways may differ), and the fit's own interval."""
    if fit.offset_ci95 is None:
        return None
    wrong = 0.5 * (fit.offset_ci95[1] - fit.offset_ci95[0])
    if fit.drift_ci95 is not None:
        wrong += 0.25 * span * (fit.drift_ci95[1] - fit.drift_ci95[0])
    return 1e6 * (0.5 * round_trip + wrong)


def _scaled(interval: tuple[float, float] | None, factor: float) -> tuple[float, float] | None:
    return None if interval is None else (factor * interval[0], factor * interval[1])


def _percentiles(values: Samples, which: Sequence[int], digits: int) -> list[float]:
    return [round(value, digits) for value in np.percentile(values, which).tolist()]


def _remarks(stream: DeviceStream, rhythm: Rhythm, foreign: Samples | None) -> list[str]:
    remarks = list[str]()
    if not stream.clocks:
        remarks.append("LSL has measured nothing of its clock: its samples have no place in the robot's time.")
    if foreign is not None:
        remarks.append(
            f"Its samples arrive {np.median(foreign):.3f} s after their stamps: it does not stamp them by LSL's clock. "
            "Their place in the robot's time is not known; set its program to LSL time stamps."
        )
    nominal, rate = stream.nominal_rate_Hz, rhythm.rate_Hz
    if rate is not None and abs(rate - nominal) > RATE_SHARE * nominal:
        remarks.append(
            f"It sends {rate:.2f} samples a second and says {nominal:g}: count on the stamps, not on a rate."
        )
    if rhythm.backward:
        remarks.append(f"{rhythm.backward} stamps are older than the one before: sort by stamp before anything else.")
    if rhythm.gaps:
        missing = sum(gap.samples for gap in rhythm.gaps)
        remarks.append(f"{len(rhythm.gaps)} gaps, with {missing:.0f} samples missing by its nominal rate.")
    if len(stream.clocks) > 1:
        remarks.append(f"It was connected {len(stream.clocks)} times: each has its own clock, and is corrected by it.")
    return remarks


def _robot(recording: Recording) -> RobotSync | None:
    ticks = recording.ticks[np.isfinite(recording.ticks["monotonic"])]
    if len(ticks) < 2:
        return None
    ahead = ticks["now"] - ticks["monotonic"]
    fit = fit_clock(ticks["monotonic"], ahead)
    if fit is None:
        return None
    scatter = Scatter(*_percentiles(1e6 * np.abs(fit.residual), (50, 99, 100), 1))
    return RobotSync(len(ticks), 1e6 * fit.drift if fit.has_drift else None, scatter)
