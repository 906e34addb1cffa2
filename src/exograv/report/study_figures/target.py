"""Figure of the touches on the target, with an ellipse for each person."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from exograv.report.style.colours import GREY, INK
from exograv.report.style.figure_style import blank
from exograv.study.measures.pointing import deviations, ellipse
from exograv.study.measures.selecting import column, rows
from exograv.study.measures.study_data import StudyData

from .groups import WIDTH_2, label, look, marked

REACH_SHARE = 99.0
"""Share of the touches within the frame [%]."""

LINES = ("-", "--", ":", "-.")


def draw(data: StudyData) -> Figure | None:
    """Draw one panel per group, all with the same scale."""
    touches = data.compared
    groups = [group for group in data.groups if group in set(touches["group"])]
    if not groups:
        return None
    unit = unit_of(data)
    reach = 1.05 * max(_reaches(touches, unit)) or 1.0
    figure = Figure(figsize=(WIDTH_2, 0.6 + WIDTH_2 / max(len(groups), 2)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, max(len(groups), 2), sharey=True))
    blank(panels[len(groups) :])
    for ax, group in zip(panels, groups, strict=False):
        _panel(ax, data, group, unit)
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", title=label(group))
        ax.set_xlabel(f"right of the centre [{unit}]")
    panels[0].set_ylabel(f"above it [{unit}]")
    return marked(figure, data)


def _reaches(touches: pd.DataFrame, unit: str) -> Iterator[float]:
    """Distances of touches and ellipses from the centre."""
    yield float(np.percentile(np.abs(deviations(touches, unit)).max(1), REACH_SHARE))
    for _, own in touches.groupby("participant"):
        points = deviations(own, unit)
        major, minor, angle = ellipse(points)
        if np.isfinite(major):
            turn = np.deg2rad(angle)
            across = np.hypot(major * np.cos(turn), minor * np.sin(turn))
            along = np.hypot(major * np.sin(turn), minor * np.cos(turn))
            yield float((np.array([across, along]) + np.abs(points.mean(0))).max())


def unit_of(data: StudyData) -> str:
    """Return millimetres if every touch has them, otherwise pixels."""
    return "px" if column(data.compared, "deviation_mm").isna().sum() else "mm"


def _panel(ax: Axes, data: StudyData, group: str, unit: str) -> None:
    style, of_group = look(data, group), rows(data.compared, data.compared["group"] == group)
    ax.grid(visible=True, axis="both")
    for k, code in enumerate(sorted(set(of_group["participant"]))):
        points = deviations(rows(of_group, of_group["participant"] == code), unit)
        ax.plot(
            *points.T, style.marker, color=style.colour, markersize=1.8, alpha=0.3, markeredgewidth=0,
            rasterized=True,
        )  # fmt: skip
        major, minor, angle = ellipse(points)
        if np.isfinite(major):
            middle = (float(points[:, 0].mean()), float(points[:, 1].mean()))
            outline = {"edgecolor": style.colour, "linestyle": LINES[k % len(LINES)], "linewidth": 1.3}
            ax.add_patch(Ellipse(middle, 2 * major, 2 * minor, angle=angle, fill=False, **outline))
            ax.plot(*middle, style.marker, color=style.colour, markeredgecolor=INK, markersize=5)
    ax.axhline(0.0, color=GREY, linewidth=0.6)
    ax.axvline(0.0, color=GREY, linewidth=0.6)
    ax.plot([0.0], [0.0], "+", color=INK, markersize=9)


def explain(data: StudyData) -> str:
    """Return the caption that explains how to read the figure."""
    points, unit = deviations(data.compared, unit_of(data)), unit_of(data)
    above = float(points[:, 1].mean())
    return (
        f"Touches as the participant sees them, {data.compared_words}; the cross is the target's centre. Each ellipse "
        "holds 95 % of a normal distribution with one person's scatter; the framed point is that person's mean. The "
        "distance of the mean from the cross is the constant error, the ellipse shows the variable error. "
        f"On average, touches are {abs(above):.1f} {unit} {'above' if above > 0 else 'below'} the centre. "
        "One touch in a hundred may lie outside the frame."
    )
