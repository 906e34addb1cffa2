"""Figure of the benchmark: left over against motion time, for all methods on the same streams of the same wearers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREEN, GREY, INK, ORANGE, PINK, RED, SKY
from exograv.report.style.figure_style import legend, mark_simulated, plain_log_axis
from exograv.study.targets import TARGET_NM

from .benchmark_result import MethodFigures

OURS = "recursive"
COLOURS = (RED, ORANGE, GREEN, PINK, SKY, GREY)
DASHES = ("-", (0, (5, 2)), (0, (1, 1.5)))
COARSE = 2.5  # times the target

TOP_NM = 3.0
"""Upper end of the axis; larger values are cut off [N·m]."""

WORDS = {"shoulder": "worst shoulder axis", "elbow": "elbow"}
PROFILES = {"harmonic": "harmonic drives", "qdd": "quasi-direct drives"}


def draw_benchmark(rows: Sequence[MethodFigures]) -> Figure:
    """Draw one row of panels per level and kind of drive: shoulder left, elbow right.

    Lines are medians, bands quartiles.
    """
    places = list(dict.fromkeys((row.level, row.profile) for row in rows))
    methods = list(dict.fromkeys(row.method for row in rows))
    figure = Figure(figsize=(9.6, 0.9 + 2.7 * len(places)), layout="constrained")
    panels = figure.subplots(len(places), len(WORDS), squeeze=False, sharex=True)
    for line, (level, profile) in zip(panels, places, strict=True):
        here = [row for row in rows if (row.level, row.profile) == (level, profile)]
        for ax, joint in zip(line, WORDS, strict=True):
            _plot(ax, here, methods, joint)
            ax.set_title(f"Level {level}, {PROFILES.get(profile, profile)}: {WORDS[joint]}")
        line[0].set_ylabel("left over [N·m]")
    for ax in panels[-1]:
        ax.set_xlabel("motion [s]")
    legend(figure, panels[:1, 0], "right center", 1)
    mark_simulated(figure)
    return figure


def _plot(ax: Axes, rows: Sequence[MethodFigures], methods: Sequence[str], joint: str) -> None:
    shown = []
    for row in rows:
        t = np.array(row.progress.t, dtype=float)
        low, middle, high = np.array(
            [[np.nan if value is None else value for value in quartile] for quartile in getattr(row.progress, joint)],
            dtype=float,
        ).reshape(3, len(t))
        if np.isfinite(middle).any():
            _plot_method(ax, row, t, (low, middle, high), methods)
            shown.append(middle)
    for factor in (1.0, COARSE):
        ax.axhline(factor * TARGET_NM[joint], color=INK, ls=(0, (3, 2)), lw=1.1 if factor == 1.0 else 0.7)
    limits = np.array([0.4 * TARGET_NM[joint], COARSE * TARGET_NM[joint]])
    plain_log_axis(ax, np.minimum(np.concatenate([*shown, limits]), TOP_NM))
    ax.set_xlim(0.0, None)


def _plot_method(
    ax: Axes,
    row: MethodFigures,
    t: np.ndarray,
    quartiles: tuple[np.ndarray, np.ndarray, np.ndarray],
    methods: Sequence[str],
) -> None:
    low, middle, high = quartiles
    colour, dashes = look(row.method, methods)
    is_ours = row.method == OURS
    marker = "o" if row.offline else None
    line = {"ls": "none" if row.offline else dashes, "marker": marker, "ms": 5, "lw": 2.2 if is_ours else 1.3}
    ax.plot(t, middle, color=colour, label=row.method, zorder=4 if is_ours else 3, **line)
    ax.fill_between(t, low, high, color=colour, alpha=0.18 if is_ours else 0.07, lw=0)


def look(method: str, methods: Sequence[str]) -> tuple[str, Any]:
    """Return colour and dashes of a method, the same in all panels; our method stands out."""
    if method == OURS:
        return BLUE, "-"
    k = [name for name in methods if name != OURS].index(method)
    return COLOURS[k % len(COLOURS)], DASHES[(k // len(COLOURS)) % len(DASHES)]
