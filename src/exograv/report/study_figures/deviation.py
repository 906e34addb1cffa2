"""Main figure of a study: deviation by group as boxes, with every touch and every person's median beside them."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from exograv.report.style.colours import GREY, INK
from exograv.report.style.figure_style import note, plain_log_axis
from exograv.study.measures.selecting import column, people, rows
from exograv.study.measures.study_data import StudyData

from .groups import WIDTH_2, GroupStyle, label, look, marked, second_axis_mm

BOX, STRIP = 1.0, 1.3
"""Widths of a box and of one person's strip of touches, in units of the axis."""

MOST_NAMED = 12
"""Largest number of people per group for which each strip has its code."""


def draw(data: StudyData, width: float = WIDTH_2) -> Figure | None:
    """Draw boxes and strips of the compared touches; the width of one journal column has no codes."""
    touches = data.compared
    if touches.empty:
        return None
    figure = Figure(figsize=(width, 3.3 if width == WIDTH_2 else 2.6), layout="constrained")
    ax = figure.subplots()
    plain_log_axis(ax, touches["deviation_px"].to_numpy(float))
    at, ticks = 0.0, {}
    for group in data.groups:
        of_group = rows(touches, touches["group"] == group)
        if of_group.empty:
            continue
        begin = at
        _box(ax, at + 0.5 * BOX, column(of_group, "deviation_px"), look(data, group))
        at = _strips(ax, at + BOX + 0.5, of_group, look(data, group))
        if width == WIDTH_2 and people(of_group) <= MOST_NAMED:
            _name_strips(ax, at, sorted(set(of_group["participant"])))
        ticks[0.5 * (begin + at)] = f"{label(group)} (n = {people(of_group)})"
        at += 1.5
    ax.set_xticks(list(ticks), list(ticks.values()))
    ax.tick_params(axis="x", length=0, pad=14)
    ax.set(xlim=(-0.8, at - 0.7), ylabel="deviation [px]")
    second_axis_mm(ax, data)
    return marked(figure, data)


def _box(ax: Axes, at: float, values: pd.Series, style: GroupStyle) -> None:
    boxes = ax.boxplot(
        [values.to_numpy(float)], whis=(5, 95), positions=[at], widths=BOX, patch_artist=True, showfliers=False
    )
    for box in boxes["boxes"]:
        box.set(facecolor=to_rgba(style.colour, 0.25), edgecolor=INK, hatch=style.hatch)
    for name in ("medians", "whiskers", "caps"):
        for line in boxes[name]:
            line.set(color=INK, linewidth=2.0 if name == "medians" else 1.0)


def _strips(ax: Axes, at: float, touches: pd.DataFrame, style: GroupStyle) -> float:
    """Draw one strip per person from `at` on, in the order of codes; return the end of the last strip."""
    for _, values in touches.groupby("participant")["deviation_px"]:
        # The position of a touch across its strip has no meaning; the fixed seed keeps the figure reproducible.
        spread = 0.38 * STRIP * np.random.default_rng(0).uniform(-1.0, 1.0, len(values))
        ax.plot(
            at + 0.5 * STRIP + spread, values, style.marker, color=style.colour, markersize=2, alpha=0.45,
            markeredgewidth=0, rasterized=True,
        )  # fmt: skip
        ends = [at + 0.1 * STRIP, at + 0.9 * STRIP]
        ax.plot(ends, [values.median()] * 2, color=INK, linewidth=2.0, solid_capstyle="butt")
        at += STRIP
    return at


def _name_strips(ax: Axes, end: float, codes: Sequence[str]) -> None:
    for k, code in enumerate(codes):
        place, look = (end - (len(codes) - k - 0.5) * STRIP, 0.0), {"ha": "center", "va": "top", "fontsize": 6}
        note(ax, code, place, (0.0, -3.0), xycoords=("data", "axes fraction"), color=GREY, **look)


def explain(data: StudyData) -> str:
    """Return the caption that explains how to read the figure."""
    share = "Logarithmic axis" + ("; millimetres on the right" if data.pitch_mm is not None else "")
    return (
        f"Deviation of the touches from the target's centre, {data.compared_words}. Boxes: all touches of a group with "
        "their quartiles; the whiskers hold 90 % of the touches. Beside each box: every touch of every person; thick "
        f"bars are the people's medians. {share}. People are the sample, not touches: differences between groups are "
        "judged on the bars."
    )
