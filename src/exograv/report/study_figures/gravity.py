"""Figure of traces aligned to the opening of windows: deviation of the touches, speed of the joints, felt level."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.figure_style import legend, plain_log_axis
from exograv.study.measures.selecting import column, columns, middle, rows
from exograv.study.measures.study_data import StudyData
from exograv.study.measures.table import SESSION

from .groups import WIDTH_2, label, look, marked

BIN_S = 2.75
"""Time of one touch at the published pace."""


def draw(data: StudyData) -> Figure | None:
    """Draw deviation on top, and speed and level below if recordings or an aircraft state them."""
    touches = data.compared
    if touches.empty:
        return None
    traces = data.with_group(data.traces).merge(columns(touches, SESSION).drop_duplicates())
    shown = [name for name in ("joint_speed_rad_per_s", "felt_level") if column(traces, name).notna().sum()]
    figure = Figure(figsize=(WIDTH_2, 2.3 + 1.1 * len(shown)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1 + len(shown), 1, sharex=True, height_ratios=[2.0] + [1.0] * len(shown)))
    _deviations(panels[0], data)
    for ax, name in zip(panels[1:], shown, strict=True):
        for group in data.groups:
            style, of = look(data, group), rows(traces, traces["group"] == group)
            course = of.groupby("t_s")[name].median()
            ax.plot(course.index, course, style.line, color=style.colour, linewidth=1.3)
        ax.set(ylabel={"felt_level": "felt weight\nor g [-]"}.get(name, "joints\n[rad/s]"), ylim=(0.0, None))
    for ax in panels:
        ax.axvspan(0.0, _length_s(data), color="0.93", zorder=0)
    panels[-1].set_xlabel("time since the window opened [s]")
    legend(figure, panels[:1], "upper left", len(data.groups))
    return marked(figure, data)


def _length_s(data: StudyData) -> float:
    windows = rows(data.tables.windows, data.tables.windows["is_complete"])
    return middle(windows.assign(length=windows["closed_s"] - windows["opened_s"]), "length")


def _deviations(ax: Axes, data: StudyData) -> None:
    touches = data.compared.assign(since=lambda table: table["t_s"] - table["opened_s"])
    touches = touches.assign(bin=(touches["since"] // BIN_S + 0.5) * BIN_S)
    plain_log_axis(ax, touches["deviation_px"].to_numpy(float))
    for group in data.groups:
        style, of = look(data, group), rows(touches, touches["group"] == group)
        ax.plot(
            of["since"], of["deviation_px"], style.marker, color=style.colour, markersize=1.5, alpha=0.25,
            markeredgewidth=0, rasterized=True,
        )  # fmt: skip
        course = of.groupby("bin")["deviation_px"].median()
        ax.plot(
            course.index, course, style.line, marker=style.marker, color=style.colour, markersize=4, linewidth=1.8,
            label=label(group),
        )  # fmt: skip
    ax.set_ylabel("deviation [px]")


def explain(data: StudyData) -> str:
    """Return the caption that explains how to read the figure."""
    below = (
        "Below, medians over windows and people of the joints' speed, and of the level by machine or aircraft."
        if len(data.traces)
        else "No recording holds the arm's motion or the felt level."
    )
    return (
        f"All windows superimposed, {data.compared_words}; grey is the open window. Points: touches; lines: "
        f"their medians for each {BIN_S} s. {below}"
    )
