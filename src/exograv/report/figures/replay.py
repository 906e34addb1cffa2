"""Figure of a replay: recorded torque, replayed torque, and their difference."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK, PALE, RED
from exograv.report.style.figure_style import joint_label, legend

from .replay_data import ReplaySeries

LABEL_SHARE = 0.045
"""Least share of the width for a phase to have its name above it."""


def draw(series: ReplaySeries) -> Figure:
    """Draw one row per joint: torques on the left, their difference on the right."""
    rows = len(series.joints)
    figure = Figure(figsize=(11.5, 1.2 + 1.65 * rows), layout="constrained")
    panels = figure.subplots(rows, 2, sharex=True, squeeze=False)
    for j, (joint, (torque, between)) in enumerate(zip(series.joints, panels, strict=True)):
        _torques(torque, series, j)
        _difference(between, series, j)
        torque.set_ylabel(f"{joint_label(joint)}\n[N·m]")
        for ax in (torque, between):
            _phases(ax, series)
    panels[0, 0].set_title("Commanded torque", pad=34)
    panels[0, 1].set_title("Replayed minus recorded", pad=34)
    for ax in panels[0]:
        _phase_names(ax, series)
    begin, end = series.span_s
    for ax in panels[-1]:
        ax.set(xlabel="time of the run [s]", xlim=(begin, max(end, begin + 1e-3)))
    legend(figure, panels[:1, 0], "lower center", 3)
    return figure


def _torques(ax: Axes, series: ReplaySeries, j: int) -> None:
    for curve, colour, width, label in (
        (series.recorded, GREY, 2.4, "recorded"),
        (series.again, BLUE, 0.9, "replayed"),
    ):
        low, high = curve.low[:, j], curve.high[:, j]
        ax.fill_between(series.t, low, high, color=colour, lw=0.0, alpha=0.45)
        ax.plot(series.t, 0.5 * (low + high), color=colour, lw=width, label=label)


def _difference(ax: Axes, series: ReplaySeries, j: int) -> None:
    largest, rms = float(series.largest[j]), float(series.rms[j])
    is_compared = np.isfinite(rms)
    ax.axhline(0.0, color=GREY, lw=0.8)
    if is_compared:
        ax.fill_between(series.t, series.difference.low[:, j], series.difference.high[:, j], color=RED, lw=0.6)
    reach = 1.15 * max(largest, series.resolution)
    ax.set_ylim(-reach, reach)
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:.3g}".replace("-", "−"))
    ax.set_ylabel("[N·m]")
    if largest <= series.resolution:
        words = "identical to the last bit" if largest == 0.0 else f"none above {series.resolution:g} N·m"
    else:
        words = f"RMS {rms:.3g}, largest {largest:.3g} N·m"
    ax.text(0.99, 0.93, words if is_compared else "not compared", transform=ax.transAxes, ha="right", va="top", size=8)


def _phases(ax: Axes, series: ReplaySeries) -> None:
    ends = [*(t for t, _ in series.phases[1:]), series.span_s[1]]
    for k, ((begin, _), end) in enumerate(zip(series.phases, ends, strict=True)):
        if k % 2:
            ax.axvspan(begin, end, color=PALE, alpha=0.5, lw=0.0, zorder=-2)
    for t in series.gaps:
        ax.axvline(t, color=INK, lw=0.8, ls=":", label="ticks missing" if t == series.gaps[0] else None)


def _phase_names(ax: Axes, series: ReplaySeries) -> None:
    first, last = series.span_s
    ends, span = [*(t for t, _ in series.phases[1:]), last], last - first
    for (begin, name), end in zip(series.phases, ends, strict=True):
        if end - begin > LABEL_SHARE * span:
            ax.text(
                0.5 * (begin + end),
                1.03,
                name,
                transform=ax.get_xaxis_transform(),
                ha="center",
                va="bottom",
                size=7.5,
                rotation=25,
            )
