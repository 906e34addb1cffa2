"""Figure of the deviation in flight: one box per condition, with every person's median."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from exograv.report.study_figures.groups import WIDTH_2
from exograv.report.style.colours import BLUE, INK, ORANGE
from exograv.report.style.figure_style import mark_simulated, name_rows, plain_ticks
from exograv.study.statistics.people import FLOOR

from .flight import FAMILIARISED, VirtualFlight, compared
from .outcome import touches_of

TEXT = (
    "Deviation of all touches of the flight by condition, the smallest median on top, familiarised people below the "
    "line. Boxes: quartiles of all touches; whiskers: 5 and 95 %. Dots: each person's median. The sample is the "
    "people, not the touches."
)


def draw(flights: Sequence[VirtualFlight]) -> Figure | None:
    """Draw one row per condition; None without any touch."""
    by_name = {name: touches_of(own) for name, own in compared(flights).items()}
    by_name = {name: touches for name, touches in by_name.items() if not touches.empty}
    if not by_name:
        return None
    order = sorted(by_name, key=lambda name: (name.startswith(FAMILIARISED), by_name[name]["deviation_px"].median()))
    figure = Figure(figsize=(WIDTH_2, 0.8 + 0.32 * len(order)), layout="constrained")
    ax = figure.subplots()
    for row, name in enumerate(order):
        touches = by_name[name]
        values = np.maximum(touches["deviation_px"].to_numpy(float), FLOOR["px"])
        colour = ORANGE if name.startswith(FAMILIARISED) else BLUE
        boxes = ax.boxplot(
            [values], whis=(5, 95), positions=[row], widths=0.6, patch_artist=True, showfliers=False,
            orientation="horizontal",
        )  # fmt: skip
        boxes["boxes"][0].set(facecolor=to_rgba(colour, 0.25), edgecolor=INK, hatch="///" if colour == ORANGE else "")
        for part in ("medians", "whiskers", "caps"):
            for line in boxes[part]:
                line.set(color=INK, linewidth=2.0 if part == "medians" else 1.0)
        medians = touches.groupby("participant")["deviation_px"].median().to_numpy(float)
        beside = row + np.linspace(-0.18, 0.18, len(medians)) if len(medians) > 1 else [float(row)]
        ax.plot(medians, beside, "s" if colour == ORANGE else "o", color=colour, markersize=4, markeredgecolor=INK,
                markeredgewidth=0.5, linestyle="none", zorder=4)  # fmt: skip
    if 0 < (last := sum(not name.startswith(FAMILIARISED) for name in order)) < len(order):
        ax.axhline(last - 0.5, color=INK, linewidth=0.7)
    ax.set_xscale("log")
    plain_ticks(ax.xaxis, np.array(ax.get_xlim()))
    name_rows(ax, [f"{name} (n = {len(set(by_name[name]['participant']))})" for name in order])
    ax.set_xlabel("deviation [px]")
    mark_simulated(figure)
    return figure
