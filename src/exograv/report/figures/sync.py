"""Figure of other devices' streams: their clocks against the robot's clock, and missing samples."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.recording.device_stream import DeviceStream
from exograv.report.style.colours import BLUE, GREY, ORANGE
from exograv.report.style.figure_style import thinned
from exograv.study.sync import StreamSync, stream_figures

DOTS_MAX = 4000
"""Largest number of dots in a panel; more dots would not be distinguishable."""


def draw(recording: Recording) -> Figure | None:
    """Draw the streams of a recording; None if there is none."""
    return draw_streams(recording.streams) if recording.streams else None


def draw_streams(streams: Sequence[DeviceStream]) -> Figure:
    """Draw a row of two panels per stream."""
    figure = Figure(figsize=(9.6, 0.4 + 2.2 * len(streams)), layout="constrained")
    rows = figure.subplots(len(streams), 2, squeeze=False)
    for (clock, rhythm), stream in zip(rows, streams, strict=True):
        _draw_clock(clock, stream)
        _draw_rhythm(rhythm, stream)
    return figure


def explain(recording: Recording) -> str:
    """Explain the accuracy of each stream's clock, and its missing samples."""
    return " ".join(_told(stream_figures(stream)) for stream in recording.streams) + (
        " Left: the offset of each device's clock as measured by LSL, and the line with which stamps are converted to "
        "the robot's clock. Right: the interval from sample to sample, in which a gap stands out. The delay of a "
        "device from the body to its stamp is known to its manufacturer only."
    )


def _told(stream: StreamSync) -> str:
    certain = stream.certain_to_us
    tied = "cannot be tied to the robot's clock" if certain is None else f"is on the robot's clock to {certain:.0f} µs"
    gaps = stream.gaps_total
    missing = "no gap" if not gaps else "one gap" if gaps == 1 else f"{gaps} gaps"
    remarks = " ".join(["", *stream.remarks])
    return f"{stream.name} ({stream.samples} samples) {tied}, with {missing}.{remarks}"


def _draw_clock(ax: Axes, stream: DeviceStream) -> None:
    """Draw LSL's measurements, without the first one, with half their round trip, and the line through them."""
    first = min(stream.corrections, key=lambda one: one.remote, default=None)
    begin, shift = (0.0, 0.0) if first is None else (first.remote, first.offset)
    of_first = f" {-shift:+.3f} s"
    ax.set(title=f"{stream.name}: offset of its clock", xlabel="time of its clock, from the first [s]")
    ax.set_ylabel(f"offset{of_first} [ms]")
    for number, fit in stream.clocks.items():
        of = [one for one in stream.corrections if one.connection == number]
        remote = np.array([one.remote for one in of])
        half = [0.5e3 * one.uncertainty for one in of]
        ax.errorbar(remote - begin, [1e3 * (one.offset - shift) for one in of], half, fmt="o", ms=3, lw=0.8, color=GREY)
        ends = np.array([remote.min(), remote.max()])
        ax.plot(ends - begin, 1e3 * (fit.correction(ends) - shift), color=BLUE)
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")


def _draw_rhythm(ax: Axes, stream: DeviceStream) -> None:
    """Draw the time from each sample to the next."""
    ax.set(title=f"{stream.name}: interval between samples", xlabel="robot's time, from the first [s]", ylabel="[ms]")
    interval = 1e3 * np.diff(stream.stamps)
    interval[np.diff(stream.connection) != 0] = np.nan
    if not len(interval):
        return
    t = stream.t if np.isfinite(stream.t).any() else stream.stamps
    shown = np.unique(np.concatenate([thinned(len(interval), DOTS_MAX), np.argsort(interval)[-DOTS_MAX // 10 :]]))
    ax.plot(t[1:][shown] - np.nanmin(t), interval[shown], ".", ms=2, color=BLUE)
    ax.set_ylim(0.0, 1.2 * max(float(np.nanmax(interval)), 1e-3))
    if stream.nominal_rate_Hz:
        ax.axhline(1e3 / stream.nominal_rate_Hz, color=ORANGE, lw=1.0)
