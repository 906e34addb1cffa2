"""Accuracy of the link between the streams of other devices and the robot's clock, and samples that are missing."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.clock_fit import ClockFit, fit_clock
from exograv.errors import RecordingError
from exograv.recording import Recording
from exograv.recording.device_stream import DeviceStream
from exograv.recording.stream_block import GAP_PERIODS

GAPS_SHOWN = 100

SEGMENT = 10
"""Least number of samples without a gap for which jitter is reported."""

ARRIVAL_S = (-0.005, 5.0)
"""Plausible delay from a corrected stamp to its arrival [s].

A delay outside this range shows that the device does not stamp by LSL's clock. A sample cannot arrive before it was
measured, except by the error of the correction.
"""

RATE_SHARE = 0.01
"""Relative difference from the nominal rate above which a remark is made."""

Samples = Float[np.ndarray, " sample"]


@dataclass(frozen=True)
class Percentiles:
    """Delays of arrivals after their stamps."""

    min: float
    p50: float
    max: float


@dataclass(frozen=True)
class Jitter:
    """Deviation of the stamps from a straight line, fitted between two gaps [µs]."""

    sd: float
    p99: float
    max: float


@dataclass(frozen=True)
class Scatter:
    """Deviation of the robot's clock from a straight line [µs]."""

    p50: float
    p99: float
    max: float


@dataclass(frozen=True)
class ResidualFigures:
    """Deviation of the corrections from the fit [µs]."""

    p50: float
    max: float


@dataclass(frozen=True)
class Gap:
    """Interval in which samples are missing, by the nominal rate."""

    t: float
    """Time of the last sample before the gap [s]."""

    seconds: float
    """Time from that sample to the next [s]."""

    samples: int


@dataclass(frozen=True)
class ClockFigures:
    """Clock of one connection against the computer's clock."""

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
    """Figures of one stream. Times named `t` are on the robot's clock."""

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
    """First gaps in the stream, at most `GAPS_SHOWN`."""

    backward_stamps: int
    connections: int
    lost: int
    silent: int
    clocks: list[ClockFigures]
    arrival_ms: Percentiles | None
    certain_to_us: float | None
    """Uncertainty of the stream's time [µs]; None if the device does not stamp by LSL's clock, or without measurements.
    """

    remarks: list[str]


@dataclass(frozen=True)
class RobotSync:
    """Rig's clock against CLOCK_MONOTONIC."""

    ticks: int
    drift_ppm: float | None
    scatter_us: Scatter


@dataclass(frozen=True)
class SyncResult:
    """Figures of `exograv data sync`."""

    recording: Path
    remark: str | None
    robot: RobotSync | None
    """Figures of the rig's clock; None without a robot, or on a virtual clock."""

    streams: list[StreamSync]


def sync_figures(recording: Recording) -> SyncResult:
    """Measure the relation of a recording's streams to the robot's clock.

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
    """Compute clock accuracy and missing samples of one stream."""
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
    """Regularity of a stream, by its stamps on the computer's clock, or on its own clock if the relation is unknown."""

    rate_Hz: float | None
    """Mean rate without gaps and reconnections [Hz]."""

    jitter_us: Jitter | None
    """Jitter of the stamps; None for a stream without a nominal rate."""

    gaps: list[Gap]

    backward: int
    """Number of stamps that are older than the stamp before."""

    @classmethod
    def of(cls, stream: DeviceStream) -> "Rhythm":
        """Compute the regularity of a stream."""
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
    """Uncertainty of the correction [µs]: half the round trip plus the fit's own interval.

    Repetition does not reduce the half round trip, because the two directions may take different times.
    """
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
        remarks.append("LSL has no measurement of its clock: the samples cannot be placed on the robot's clock.")
    if foreign is not None:
        remarks.append(
            f"Its samples arrive {np.median(foreign):.3f} s after their stamps: it does not use LSL's clock. Their "
            "time on the robot's clock is not known; set the device's program to LSL time stamps."
        )
    nominal, rate = stream.nominal_rate_Hz, rhythm.rate_Hz
    if rate is not None and abs(rate - nominal) > RATE_SHARE * nominal:
        remarks.append(
            f"The device sends {rate:.2f} samples/s and states {nominal:g}: rely on the stamps, not on a rate."
        )
    if rhythm.backward:
        remarks.append(f"{rhythm.backward} stamps are older than the stamp before: sort by stamp before any analysis.")
    if rhythm.gaps:
        missing = sum(gap.samples for gap in rhythm.gaps)
        remarks.append(f"{len(rhythm.gaps)} gaps, with {missing:.0f} samples missing by the nominal rate.")
    if len(stream.clocks) > 1:
        remarks.append(
            f"The device was connected {len(stream.clocks)} times: each connection has its own clock and correction."
        )
    return remarks


def _robot(recording: Recording) -> RobotSync | None:
    pieces = recording.pieces(("now", "monotonic"))
    timed = [ticks[np.isfinite(ticks["monotonic"])] for ticks in pieces]
    if not timed:
        return None
    ticks = np.concatenate(timed)
    if len(ticks) < 2:
        return None
    ahead = ticks["now"] - ticks["monotonic"]
    fit = fit_clock(ticks["monotonic"], ahead)
    if fit is None:
        return None
    scatter = Scatter(*_percentiles(1e6 * np.abs(fit.residual), (50, 99, 100), 1))
    return RobotSync(len(ticks), 1e6 * fit.drift if fit.has_drift else None, scatter)
