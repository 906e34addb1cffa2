"""Figure of a session's course: median deviation of each window, and costs of the first touch and of a rest."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.figure_style import legend, plain_log_axis
from exograv.study.measures.selecting import column, columns, rows
from exograv.study.measures.study_data import StudyData
from exograv.study.measures.table import SESSION

from .groups import WIDTH_2, label, look, marked, second_axis_mm
from .learning import course

COSTS = {
    "first_window_cost": "first\nwindow",
    "first_touch_cost": "first\ntouch",
    "cost_of_rest": "after\na rest",
    "cost_of_long_rest": "after a\nlong rest",
}


def draw(data: StudyData) -> Figure | None:
    """Draw windows on the left, costs on the right."""
    kept = columns(data.compared, SESSION).drop_duplicates()
    medians = data.measure("median_deviation_px", "window").merge(kept)
    if medians.empty:
        return None
    figure = Figure(figsize=(WIDTH_2, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    # A person with several flights has one line: the median over the flights.
    by_person = medians.groupby(["participant", "group", "window"])["value"].median().reset_index()
    course(left, data, by_person, "window")
    plain_log_axis(left, medians["value"].to_numpy(float))
    left.set(xlabel="window", ylabel="median deviation [px]")
    legend(figure, [left], "upper left", len(data.groups))
    second_axis_mm(left, data)
    _costs(right, data, kept)
    return marked(figure, data)


def _costs(ax: Axes, data: StudyData, kept: pd.DataFrame) -> None:
    found = {name: data.measure(name).merge(kept) for name in COSTS}
    shown = [name for name in COSTS if not found[name].empty]
    for at, name in enumerate(shown):
        for k, group in enumerate(data.groups):
            style = look(data, group)
            values = np.exp(column(rows(found[name], found[name]["group"] == group), "value").to_numpy(float))
            x = at + 0.24 * (k - 0.5 * (len(data.groups) - 1))
            ax.plot([x] * len(values), values, style.marker, color=style.colour, markersize=4, alpha=0.8)
            if len(values):
                ax.plot([x - 0.09, x + 0.09], [np.exp(np.log(values).mean())] * 2, color=style.colour, linewidth=2.0)
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.set_xticks(range(len(shown)), [COSTS[name] for name in shown], fontsize=6.5)
    ax.set(xlim=(-0.6, len(shown) - 0.4), ylabel="deviation over the usual")


def explain(data: StudyData) -> str:
    """Return the caption that explains how to read the figure."""
    names = " and ".join(label(group) for group in data.groups)
    return (
        f"Left: median deviation by window, {data.compared_words}; thin lines are people, thick lines {names}. "
        "Right, one point per person: ratio of the deviation in the first window to that in the others, at a window's "
        "first touch to that at its later touches, and in the first half of a window to that in the second half of the "
        "window before, after any rest and after a rest of at least 1.5 times the usual length. Above 1 is worse."
    )
