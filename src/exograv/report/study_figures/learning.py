"""Figure of the change of deviation from session to session of each protocol, for each person and each group."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exograv.report.style.figure_style import legend, plain_log_axis
from exograv.study.measures.selecting import column, keys, rows
from exograv.study.measures.study_data import PRIMARY, StudyData

from .groups import WIDTH_2, label, look, marked, second_axis_mm


def draw(data: StudyData) -> Figure | None:
    """Draw one panel per protocol, with a width by its number of sessions."""
    medians = data.measure("median_deviation_px")
    if medians.empty or len(set(keys(medians, ["participant", "protocol"]))) == len(medians):
        return None
    protocols = sorted(set(medians["protocol"]), key=lambda name: (name == PRIMARY, name))
    sessions = [max(column(rows(medians, medians["protocol"] == name), "session").tolist()) for name in protocols]
    widths = [max(n, 4) for n in sessions]
    figure = Figure(figsize=(WIDTH_2, 3.0), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(protocols), sharey=True, width_ratios=widths))
    for ax, protocol, last in zip(panels, protocols, sessions, strict=True):
        course(ax, data, rows(medians, medians["protocol"] == protocol), "session")
        ax.set(title=protocol, xlim=(0.5, last + 0.5), xlabel="session")
    plain_log_axis(panels[0], medians["value"].to_numpy(float))
    panels[0].set_ylabel("median deviation [px]")
    second_axis_mm(panels[-1], data)
    legend(figure, panels, "upper left", len(data.groups))
    return marked(figure, data)


def course(ax: Axes, data: StudyData, medians: pd.DataFrame, over: str) -> None:
    """Draw a thin line per person with its gaps, and a thick line per group: the geometric mean of its people."""
    for group in data.groups:
        style, of_group = look(data, group), rows(medians, medians["group"] == group)
        for _, person in of_group.groupby("participant"):
            line = dict(keys(person, [over, "value"]))
            whole = range(min(line), max(line) + 1)
            ax.plot(
                whole, [line.get(at, np.nan) for at in whole], style.line, marker=style.marker, markersize=2.5,
                color=style.colour, alpha=0.45, linewidth=0.8,
            )  # fmt: skip
        if not of_group.empty:
            logs = dict[int, list[float]]()
            for at, value in keys(of_group, [over, "value"]):
                logs.setdefault(at, []).append(np.log(value))
            ax.plot(
                sorted(logs), [np.exp(np.mean(logs[at])) for at in sorted(logs)], style.line, marker=style.marker,
                color=style.colour, markersize=4, linewidth=2.2, label=label(group),
            )  # fmt: skip
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def explain(data: StudyData) -> str:
    """Explain the figure, with the slope of each person."""
    slopes = data.measure("slope_across_sessions", "participant")
    said = [
        f"{protocol}: {', '.join(f'{100 * np.expm1(value):+.1f} %' for value in of['value'])}".replace("-", "−")
        for protocol, of in slopes.groupby("protocol")
    ]
    change = f" Change from session to session, one value per person (Theil–Sen): {'; '.join(said)}." if said else ""
    return (
        "Median deviation of each session. Thin lines: people; a gap in a line is a missing session. Thick lines: "
        f"geometric mean of the people who have that session.{change}"
    )
