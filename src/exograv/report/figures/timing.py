"""Figure of the duration of the control ticks, and share of ticks in which the envelope limited the torque."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.report.style.colours import BLUE, INK, RED
from exograv.report.style.figure_style import joint_label, note

USUAL_US = 1000.0
"""Period of a recording that states none [µs]."""

PERCENTILES = (50.0, 99.0, 99.9)


def period_us(recording: Recording) -> float:
    """Period of the control loop [µs], as the live run or the first pilot states it."""
    live = (recording.settings.get("settings") or {}).get("live") or {}
    stated = [live.get("period_s"), *(message.get("period_s") for message in recording.messages("/control"))]
    return next((1e6 * float(period_s) for period_s in stated if period_s is not None), USUAL_US)


def draw(recording: Recording) -> Figure | None:
    """Draw the durations of the ticks on logarithmic axes, because the rare long ticks matter."""
    times, budget_us = recording.computing_times, period_us(recording)
    tick_us = times.values_us
    if len(times) < 100:
        return None
    figure = Figure(figsize=(9.6, 2.9), layout="constrained")
    ax = figure.subplots()
    edges = np.geomspace(max(0.1, tick_us.min() * 0.9), max(1.2 * budget_us, tick_us.max() * 1.1), 90)
    counts, _, _ = ax.hist(tick_us, list(edges), weights=times.counts, color=BLUE, log=True)
    ax.set_ylim(0.7, 8.0 * np.max(counts))  # leaves room above the bars for the names of the lines
    ax.set_xscale("log")
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    for share, value in zip(PERCENTILES, times.percentiles(PERCENTILES), strict=True):
        _mark(ax, value, f"p{share:g}", INK, lw=1.0, ls=(0, (3, 2)))
    _mark(ax, budget_us, "one period", RED, lw=1.6)
    ax.set(xlabel="time for one tick [µs]", ylabel="number of ticks")
    return figure


def _mark(ax: Axes, value: float, name: str, colour: str, **line: Any) -> None:
    ax.axvline(value, color=colour, **line)
    place = ("data", "axes fraction")
    note(ax, name, (value, 1.0), (2, -2), xycoords=place, va="top", fontsize=8, rotation=90, color=colour)


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    times, budget_us = recording.computing_times, period_us(recording)
    p50, p99, p999 = times.percentiles(PERCENTILES)
    late = times.counts[times.values_us > budget_us].sum()
    return (
        f"The controller has to finish {1e6 / budget_us:.0f} times a second. The bars count the ticks by their "
        f"duration: half of the ticks took less than {p50:.0f} µs, 99 % less than {p99:.0f} µs, 99.9 % less than "
        f"{p999:.0f} µs; {late} of {len(times)} took longer than one period. {_envelope_sentence(recording)}"
    )


def _envelope_sentence(recording: Recording) -> str:
    share = recording.computing_times.limited_share
    if not share.any():
        return "The envelope did not change any torque."
    words = ", ".join(
        f"{joint_label(j)} {100.0 * s:.2f} %" for j, s in zip(recording.joints, share, strict=True) if s > 0
    )
    return f"Share of the ticks in which the envelope limited the torque: {words}."
