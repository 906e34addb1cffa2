"""Plots of a benchmark run: single calls, cost against the number of joints, batches against their size."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from peers.opponents import OPPONENTS, Native

MORE_COLOURS = ("black", "navy", "olive")
COLOURS = {each.name: f"C{i}" if i < 10 else MORE_COLOURS[i - 10] for i, each in enumerate(OPPONENTS)}
BARS = ("rnea_7", "torque_gradient_7", "tick_aligned_7", "tick_general_4")
BATCHES = ("rnea_7", "torque_gradient_7", "tick_aligned_7", "tick_general_4")
SIZES = (1, 64, 1024, 16384)
# Without a date and random names the same run gives the same file.
plt.rcParams.update({"svg.hashsalt": "exograv", "font.size": 9})


def draw_single(result: dict[str, Any], path: Path) -> None:
    """Draw the median time of a call, one panel per task."""
    figure, panels = plt.subplots(2, 2, figsize=(10, 5.5), sharex=True)
    for panel, name in zip(panels.flat, BARS, strict=True):
        rows = sorted((row for row in result["rows"] if row["name"] == name), key=lambda row: -row["p50"])
        names = [row["implementation"] for row in rows]
        bars = panel.barh(names, [row["p50"] for row in rows], color=[COLOURS[who] for who in names])
        panel.bar_label(bars, fmt="{:.3g}", padding=2, fontsize=7)
        panel.set_xscale("log")
        panel.set_xlim(0.05, 1000.0)
        panel.set_title(name)
        panel.tick_params(axis="y", labelsize=7)
    for panel in panels[1]:
        panel.set_xlabel("µs a call, median")
    _save(figure, path)


def draw_joints(result: dict[str, Any], path: Path) -> None:
    """Draw the time of inverse dynamics of a chain against its number of joints."""
    figure, panel = plt.subplots(figsize=(6, 4))
    found: dict[str, list[tuple[int, float]]] = {}
    for row in result["rows"]:
        if match := re.fullmatch(r"rnea_chain_(\d+)", row["name"]):
            found.setdefault(row["implementation"], []).append((int(match[1]), row["p50"]))
    _lines(panel, found)
    panel.legend(fontsize=7)
    panel.set_xticks(sorted({joints for points in found.values() for joints, _ in points}))
    panel.set_yscale("log")
    panel.set_xlabel("joints")
    panel.set_ylabel("inverse dynamics of a chain, µs a call, median")
    _save(figure, path)


def draw_batch(result: dict[str, Any], path: Path) -> None:
    """Draw evaluations a second on one core against the size of the batch, one panel per task."""
    figure, panels = plt.subplots(1, len(BATCHES), figsize=(11, 3.6), sharey=True)
    for panel, task in zip(panels, BATCHES, strict=True):
        found: dict[str, list[tuple[int, float]]] = {}
        for row in result["rows"]:
            if match := re.fullmatch(rf"batch_{task}_(\d+)_f64_one_core", row["name"]):
                found.setdefault(row["implementation"], []).append((int(match[1]), row["p50"]))
        _lines(panel, found)
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xticks(SIZES, map(str, SIZES))
        panel.set_title(task)
        panel.set_xlabel("states")
    panels[0].set_ylabel("evaluations a second, one core")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=len(labels), fontsize=7, loc="lower center", frameon=False)
    _save(figure, path, below=0.06)


def _lines(panel: Axes, found: dict[str, list[tuple[int, float]]]) -> None:
    for who, points in found.items():
        width = 2.5 if who == Native.name else 1.2
        panel.plot(
            *zip(*sorted(points), strict=True), "o-", label=who, color=COLOURS[who], linewidth=width, markersize=3
        )
    panel.grid(visible=True, which="both", alpha=0.2)


def _save(figure: Any, path: Path, below: float = 0.0) -> None:
    figure.tight_layout(rect=(0.0, below, 1.0, 1.0))
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


ALL: dict[str, Callable[[dict[str, Any], Path], None]] = {
    "single": draw_single,
    "joints": draw_joints,
    "batch": draw_batch,
}
