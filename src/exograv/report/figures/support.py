"""Figure of reach against support: share of all targets, and maps of the targets at several supports."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK, ORANGE, PALE
from exograv.report.style.figure_style import mark_simulated

from .support_data import SupportOutcome

MAPS_PERCENT = (100, 75, 50, 25, 0)


def draw_support(result: SupportOutcome, is_simulated: bool) -> Figure:
    """Draw the share of reached targets against support (left), and maps with the chance of each target (right)."""
    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    left, *maps = figure.subplots(1, 1 + len(MAPS_PERCENT), width_ratios=[3.2, *[1.0] * len(MAPS_PERCENT)])
    _plot_share(left, result)
    for ax, percent in zip(maps, MAPS_PERCENT, strict=True):
        _plot_map(ax, result, percent)
    maps[0].set_ylabel("height about the shoulder [°]")
    maps[len(maps) // 2].set_xlabel("outward from straight ahead [°]; small circles: nearer targets")
    if is_simulated:
        mark_simulated(figure)
    return figure


def _plot_share(ax: Axes, result: SupportOutcome) -> None:
    curve, x = result.curve, result.curve.support_percent
    ax.fill_between(x, 100 * curve.low, 100 * curve.high, color=BLUE, alpha=0.2, lw=0)
    ax.plot(x, 100 * curve.share, color=BLUE, label="targets reached, 95 % band; ticks: attempts")
    ax.axhline(100 * result.criterion, color=GREY, ls="--", lw=1)
    low, high = result.ci95
    ax.axvspan(low, high, color=ORANGE, alpha=0.25, lw=0, label="support needed, 95 % interval")
    if result.support_percent is not None:
        ax.axvline(result.support_percent, color=ORANGE)
    for hit, y, marker in ((True, 103, "|"), (False, -3, "|")):
        tried = [one.support_percent for one in result.tried if one.reached is hit]
        ax.plot(tried, np.full(len(tried), y), marker, color=INK, ms=6, alpha=0.6)
    ax.set_xlim(101, -1)  # The axis is reversed, because support decreases during the test.
    ax.set(ylim=(-7, 107), xlabel="weight of the arm that is carried [%]", ylabel="targets reached [%]")
    ax.legend(loc="lower left")


def _plot_map(ax: Axes, result: SupportOutcome, percent: int) -> None:
    place = int(np.argmin(np.abs(result.curve.support_percent - percent)))
    chances = result.curve.by_target[:, place]
    for target, chance in zip(result.by_target, chances.tolist(), strict=True):
        near = target.share_of_length < 0.8
        # A near target is drawn beside the far one of its direction.
        x, y = target.outward_deg + (11 if near else 0), target.up_deg + (6 if near else 0)
        ax.scatter(x, y, s=35 if near else 120, color=BLUE, alpha=max(chance, 0.02), lw=0)
        ax.scatter(x, y, s=35 if near else 120, facecolors="none", edgecolors=INK, lw=0.8)
    ax.set(
        title=f"{percent} %\n{chances.sum():.1f} of {len(chances)}", xlim=(-25, 55), ylim=(-52, 25), facecolor="white"
    )
    ax.grid(color=PALE)
    if percent != MAPS_PERCENT[0]:
        ax.set_yticklabels([])
