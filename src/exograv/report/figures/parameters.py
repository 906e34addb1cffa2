"""Figure of the arm's parameters: estimates and intervals during the identification."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.report.style.colours import BLUE, GREEN, ORANGE
from exograv.report.style.figure_style import blank, legend, thinned

COLUMNS = 5
MOST_PANELS = 20
"""Largest number of panels for a reader. The table below the figures has all parameters."""

MOST_POINTS = 120
"""Points of a curve; enough for its width on paper."""


def draw(recording: Recording) -> Figure | None:
    """Draw a small panel per parameter: estimate and interval against seconds of motion, with prior and truth."""
    estimates = recording.messages("/estimate")
    if len(estimates) < 2:
        return None
    estimates = [estimates[int(k)] for k in thinned(len(estimates), MOST_POINTS)]
    truth = {entry["name"]: entry.get("truth") for entry in recording.last("/result").get("parameters", [])}
    names = most_learned(estimates[0]["parameters"], estimates[-1]["parameters"])
    rows = math.ceil(len(names) / COLUMNS)
    figure = Figure(figsize=(9.6, 0.5 + 1.32 * rows), layout="constrained")
    panels = figure.subplots(rows, min(COLUMNS, len(names)), sharex=True, squeeze=False).ravel()
    seconds = np.array([message["motion_s"] for message in estimates])
    for ax, name in zip(panels, names, strict=False):
        entries = [next(e for e in message["parameters"] if e["name"] == name) for message in estimates]
        plot_parameter(ax, seconds, entries, truth.get(name))
    blank(panels[len(names) :])
    figure.supxlabel("motion since the identification began [s]", fontsize=9)
    legend(figure, panels, "upper center", 4)
    return figure


def most_learned(first: list[dict], last: list[dict]) -> list[str]:
    """Return the parameters whose intervals shrank most between two estimates, in the order of the recording."""
    before = {entry["name"]: entry for entry in first}
    closed = [_width(entry) / (_width(before.get(entry["name"], entry)) or math.inf) for entry in last]
    chosen = sorted(np.argsort(closed, kind="stable")[:MOST_PANELS])
    return [last[k]["name"] for k in chosen]


def _width(entry: dict) -> float:
    low, high = entry["ci95"] or (0.0, math.inf)
    return high - low


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    results = [entry for entry in recording.last("/result").get("parameters", []) if entry.get("truth") is not None]
    inside = sum(entry["ci95"][0] <= entry["truth"] <= entry["ci95"][1] for entry in results if entry.get("ci95"))
    held = f" At the end the true value lies inside for {inside} of {len(results)} parameters." if results else ""
    return (
        "Each small panel shows one property of the arm, a mass or its position. The blue line is the estimate; the "
        "pale band holds the true value with 95 % certainty. The band should shrink and stay around the green line, "
        "the true value, which only the twin knows. The dotted line is the value of body tables. A band that stays "
        "wide means that the motion did not excite this parameter; this has no effect if the torque does not depend on "
        f"it either. At most {MOST_PANELS} parameters are shown, those with the largest improvement; the table has "
        f"all.{held}"
    )


def plot_parameter(ax: Axes, seconds: np.ndarray, entries: list[dict], truth: float | int | None) -> None:
    """Draw estimate, interval, prior and true value of one parameter."""
    bounds = np.array([entry["ci95"] or (math.nan, math.nan) for entry in entries], dtype=float)
    ax.fill_between(seconds, bounds[:, 0], bounds[:, 1], color=BLUE, alpha=0.18, lw=0, label="95 % interval")
    ax.plot(seconds, [entry["estimate"] for entry in entries], color=BLUE, lw=1.3, label="estimate")
    ax.axhline(entries[-1]["prior"], color=ORANGE, lw=1.0, ls=":", label="body table")
    if truth is not None:
        ax.axhline(truth, color=GREEN, lw=1.1, label="truth (twin)")
    unit = entries[-1]["unit"]
    segment, _, quantity = entries[-1]["name"].replace("_", " ").rpartition(".")
    ax.set_title(f"{segment} {quantity} [{unit}]", fontsize=7, fontweight="normal", pad=3)
    ax.tick_params(labelsize=6.5)
    ax.locator_params(axis="y", nbins=4)
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4), useOffset=False)
    ax.yaxis.get_offset_text().set_fontsize(6.5)
    ax.set_xlim(0.0, seconds[-1])
