"""The validation as a picture: where first windows land under each gravity, touch by touch; simulated."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.figure_style import BLUE, GREY, INK, ORANGE

PICTURE = "participant_validation.png"
COLOURS = {"0.0": BLUE, "1.0": INK, "1.8": ORANGE}


def write_picture(result: dict[str, Any], folder: Path) -> Path:
    """Into this folder."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    ax = figure.subplots()
    for level, people in result["touches"].items():
        rows = [[touch["up_mm"] for touch in windows[0]] for windows in people]
        for row in rows:
            ax.plot(range(1, len(row) + 1), row, color=COLOURS[level], alpha=0.25, linewidth=0.8)
        n = min(map(len, rows))
        mean = np.mean([row[:n] for row in rows], axis=0)
        ax.plot(range(1, n + 1), mean, "o-", color=COLOURS[level], label=f"{float(level):g} g")
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.set(xlabel="touch of the first window", ylabel="above the target [mm]")
    ax.set_title(f"Virtual participants, simulated: {result['people']} people and their mean", fontsize=10)
    ax.legend(frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / PICTURE
    figure.savefig(path, dpi=150)
    return path
