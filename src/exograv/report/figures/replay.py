"""Figure of a replay: recorded torque, replayed torque, and their difference."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK, PALE, RED
from exograv.report.style.figure_style import joint_label, legend

BINS = 600
"""Number of stretches of a curve. Each shows its smallest and its largest value, so that no single tick is lost."""

LABEL_SHARE = 0.045
"""Least share of the width for a phase to have its name above it."""

Torques = Float[np.ndarray, "tick joint"]


@dataclass(frozen=True)
class Series:
    """Curves of the figure."""

    t: Float[np.ndarray, " tick"]
    """Time on the rig's clock [s]."""
    recorded: Torques
    """Recorded commanded torque [N·m]."""
    again: Torques
    """Replayed commanded torque [N·m]."""
    difference: Torques
    """Difference between the two; NaN without a comparison [N·m]."""
    joints: tuple[str, ...]
    phases: list[tuple[float, str]]
    """Beginning [s] and name of each phase."""
    gaps: list[float]
    """Times at which ticks are missing [s]."""
    resolution: float
    """Largest difference that counts as none [N·m]."""


def draw(series: Series) -> Figure:
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
    for ax in panels[-1]:
        ax.set(xlabel="time of the run [s]", xlim=(series.t[0], max(series.t[-1], series.t[0] + 1e-3)))
    legend(figure, panels[:1, 0], "lower center", 3)
    return figure


def _torques(ax: Axes, series: Series, j: int) -> None:
    for values, colour, width, label in (
        (series.recorded, GREY, 2.4, "recorded"),
        (series.again, BLUE, 0.9, "replayed"),
    ):
        t, low, high = extremes(series.t, values[:, j])
        ax.fill_between(t, low, high, color=colour, lw=0.0, alpha=0.45)
        ax.plot(t, 0.5 * (low + high), color=colour, lw=width, label=label)


def _difference(ax: Axes, series: Series, j: int) -> None:
    values = series.difference[:, j]
    t, low, high = extremes(series.t, values)
    finite = values[np.isfinite(values)]
    largest = float(np.abs(finite).max(initial=0.0))
    ax.axhline(0.0, color=GREY, lw=0.8)
    if len(finite):
        ax.fill_between(t, low, high, color=RED, lw=0.6)
    reach = 1.15 * max(largest, series.resolution)
    ax.set_ylim(-reach, reach)
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:.3g}".replace("-", "−"))
    ax.set_ylabel("[N·m]")
    if largest <= series.resolution:
        words = "identical to the last bit" if largest == 0.0 else f"none above {series.resolution:g} N·m"
    else:
        words = f"RMS {np.sqrt(np.mean(finite**2)):.3g}, largest {largest:.3g} N·m"
    ax.text(0.99, 0.93, words if len(finite) else "not compared", transform=ax.transAxes, ha="right", va="top", size=8)


def _phases(ax: Axes, series: Series) -> None:
    ends = [*(t for t, _ in series.phases[1:]), series.t[-1]]
    for k, ((begin, _), end) in enumerate(zip(series.phases, ends, strict=True)):
        if k % 2:
            ax.axvspan(begin, end, color=PALE, alpha=0.5, lw=0.0, zorder=-2)
    for t in series.gaps:
        ax.axvline(t, color=INK, lw=0.8, ls=":", label="ticks missing" if t == series.gaps[0] else None)


def _phase_names(ax: Axes, series: Series) -> None:
    ends, span = [*(t for t, _ in series.phases[1:]), series.t[-1]], series.t[-1] - series.t[0]
    for (begin, name), end in zip(series.phases, ends, strict=True):
        if end - begin > LABEL_SHARE * span:
            place = (0.5 * (begin + end), 1.03)
            ax.text(*place, name, transform=ax.get_xaxis_transform(), ha="center", va="bottom", size=7.5, rotation=25)


def extremes(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean time, smallest and largest value of each of `BINS` stretches; NaN for a stretch without values."""
    starts = np.unique(np.linspace(0, len(t), BINS, endpoint=False).astype(int))
    low, high = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    ends = np.append(starts[1:], len(t)) - 1
    return 0.5 * (t[starts] + t[ends]), low, high
