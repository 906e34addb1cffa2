"""Figure of the touches: every touch on the target, and the deviations by window."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from exograv.recording import Recording
from exograv.report.style.colours import BLUE, GREY, INK, ORANGE, PALE


def draw(recording: Recording) -> Figure | None:
    """Draw the accepted touches on the target, and the deviation by window."""
    touches = counted(recording)
    if not touches:
        return None
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    target, by_window = figure.subplots(1, 2, width_ratios=(1.0, 1.7))
    _on_target(target, recording, touches)
    _by_window(by_window, touches)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    touches, refused = counted(recording), len(_touches(recording)) - len(counted(recording))
    deviation = np.median([touch["deviation_px"] for touch in touches])
    return (
        "Each point is an accepted touch, right and up of the target's centre as the participant sees it; earlier "
        f"touches are pale. Half of the {len(touches)} touches are within {deviation:.0f} px. The right panel shows "
        f"the deviations of each window and their median. {refused} touches were rejected."
    )


def counted(recording: Recording) -> list[dict[str, Any]]:
    """Return the records of the accepted touches."""
    return [touch for touch in _touches(recording) if touch["is_accepted"]]


def _touches(recording: Recording) -> list[dict[str, Any]]:
    return [message["record"] for message in recording.messages("/task") if message["kind"] == "touch"]


def _on_target(ax: Axes, recording: Recording, touches: list[dict[str, Any]]) -> None:
    unit = "px" if touches[0]["deviation_mm"] is None else "mm"
    x, y = (np.array([touch[f"deviation_{axis}_{unit}"] for touch in touches]) for axis in "xy")
    protocol = (recording.settings.get("settings") or {}).get("protocol") or {}
    diameter = (protocol.get("target") or {}).get(f"diameter_{unit}")
    if diameter is not None:
        ax.add_patch(Circle((0.0, 0.0), 0.5 * diameter, facecolor=PALE, edgecolor=GREY))
    order = np.arange(len(touches)) / max(len(touches) - 1, 1)
    ax.scatter(x, -y, s=14, color=[to_rgba(BLUE, 0.25 + 0.75 * share) for share in order], linewidths=0)
    ax.plot([0.0], [0.0], "+", color=INK)
    reach = 1.1 * float(np.abs([x, y]).max(initial=0.6 * (diameter or 1.0)))
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.set(xlabel=f"right of the centre [{unit}]", ylabel=f"above it [{unit}]")


def _by_window(ax: Axes, touches: list[dict[str, Any]]) -> None:
    windows = sorted({touch["window"] for touch in touches})
    values = {k: [touch["deviation_px"] for touch in touches if touch["window"] == k] for k in windows}
    for k in windows:
        ax.plot([k] * len(values[k]), values[k], "o", color=BLUE, markersize=3, alpha=0.5)
    ax.plot(windows, [np.median(values[k]) for k in windows], color=ORANGE, label="median")
    ax.set_ylim(0.0, None)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel="window", ylabel="deviation [px]")
    ax.legend(loc="upper right")
