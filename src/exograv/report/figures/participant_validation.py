"""Figure of virtual participants: height of each touch of the first window, by gravity level; simulated."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK, ORANGE
from exograv.report.style.figure_style import mark_simulated

COLOURS = {"0.0": BLUE, "1.0": INK, "1.8": ORANGE}


def draw(up_mm: Mapping[str, Sequence[Sequence[float]]]) -> Figure:
    """Draw the height above the target of each touch, by gravity level and participant [mm]."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    ax = figure.subplots()
    for level, rows in up_mm.items():
        for row in rows:
            ax.plot(range(1, len(row) + 1), row, color=COLOURS[level], alpha=0.25, linewidth=0.8)
        n = min(map(len, rows))
        mean = np.mean([row[:n] for row in rows], axis=0)
        ax.plot(range(1, n + 1), mean, "o-", color=COLOURS[level], label=f"{float(level):g} g")
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.set(xlabel="touch of the first window", ylabel="above the target [mm]")
    people = len(next(iter(up_mm.values())))
    ax.set_title(f"Virtual participants, simulated: {people} people and their mean", fontsize=10)
    ax.legend()
    return mark_simulated(figure)
