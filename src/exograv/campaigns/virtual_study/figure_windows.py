"""Figure of the height of touches, window by window of the flight: each condition beside familiarisation only."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.study_figures.groups import WIDTH_2
from exograv.report.style.colours import BLUE, GREY, INK
from exograv.report.style.figure_style import blank, mark_simulated
from exograv.study.statistics.fieller import mean_interval

from .flight import FAMILIARISED, VirtualFlight, compared

COLUMNS = 4
TEXT = (
    "Mean height of the touches above the target (signed), window by window. Thin lines: each person. Thick lines: "
    "mean over people, only in windows that all of the condition's people have, so that missing people do not move "
    "it. Bands: its 95 % interval by Student's t, unlimited and left out for fewer than two people. Blue, solid: "
    "after the training. Grey, dashed: after familiarisation only, the same in every panel."
)


def draw(flights: Sequence[VirtualFlight]) -> Figure | None:
    """Draw one panel per condition; None without any touch."""
    by_name = {name: of for name, own in compared(flights).items() if (of := by_window(own)).size}
    if not by_name:
        return None
    usual = next((of for name, of in by_name.items() if name.startswith(FAMILIARISED)), None)
    names = [name for name in by_name if not name.startswith(FAMILIARISED)] or list(by_name)
    across = min(COLUMNS, len(names))
    lines = ceil(len(names) / across)
    figure = Figure(figsize=(WIDTH_2, 0.6 + 1.55 * lines), layout="constrained")
    panels = figure.subplots(lines, across, squeeze=False, sharex=True, sharey=True).ravel()
    blank(panels[len(names) :])
    for ax, name in zip(panels, names, strict=False):
        if usual is not None and not name.startswith(FAMILIARISED):
            _course(ax, usual, GREY, "--")
        _course(ax, by_name[name], BLUE, "-")
        ax.axhline(0.0, color=INK, linewidth=0.7)
        ax.set_title(name, fontsize=7)
        ax.tick_params(labelbottom=True)
        ax.xaxis.get_major_locator().set_params(integer=True)
    figure.supxlabel("window", fontsize=8)
    figure.supylabel("above the target [mm]", fontsize=8)
    mark_simulated(figure)
    return figure


def by_window(flights: Sequence[VirtualFlight]) -> np.ndarray:
    """Mean `up_mm` (person, window) of people with touches, window 1 first; NaN for a window without a touch."""
    found = list[dict[int, list[float]]]()
    for flight in flights:
        own = dict[int, list[float]]()
        for touch in flight.touches:
            own.setdefault(touch.window, []).append(touch.up_mm)
        if own:
            found.append(own)
    windows = range(1, max((max(own) for own in found), default=0) + 1)
    return np.array([[np.mean(own.get(w, [np.nan])) for w in windows] for own in found])


def _course(ax: Axes, up_mm: np.ndarray, colour: str, line: str) -> None:
    windows = np.arange(1, up_mm.shape[1] + 1)
    for own in up_mm:
        ax.plot(windows, own, line, color=colour, linewidth=0.4, alpha=0.5)
    # The mean is NaN, and the line has a gap, where a person has no touch.
    ax.plot(windows, up_mm.mean(axis=0), line, color=colour, linewidth=1.4, marker="o", markersize=1.8)
    bands = [mean_interval(column) for column in up_mm.T]
    low, high = ([np.nan if band is None else getattr(band, end) for band in bands] for end in ("low", "high"))
    ax.fill_between(windows, low, high, color=colour, alpha=0.18, linewidth=0)
