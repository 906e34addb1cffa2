"""Figure of the left over before and after identification."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.report.style.colours import BLUE, GREY, INK, ORANGE
from exograv.report.style.figure_style import joint_label, legend, note
from exograv.study.targets import targets

Scores = Mapping[str, Sequence[float | int]]
"""Residual torque per joint [N·m], by the name of the stage in `STAGES`."""

STAGES = {
    "exo_only": ("machine carried, arm not", GREY),
    "table": ("arm by body table", ORANGE),
    "identified": ("arm identified", BLUE),
}
"""Words and colour by name in the recording."""

CROWDED = 5  # Names of at most so many joints fit beside each other.
CLOSE_UP = 5.0
"""Upper end of a close-up, as a multiple of the largest target [-]."""

LABELLED_SHARE = 0.08
"""Share of the axis below which a bar has no number without a close-up; the close-up shows the number [-]."""


def draw(recording: Recording) -> Figure | None:
    """Draw the left over per joint: everything, a close-up of it, and the arm alone."""
    scores = recording.last("/result").get("left_over_rms_Nm") or {}
    total, arm = scores.get("total") or {}, scores.get("arm") or {}
    if not total:
        return None
    figure = Figure(figsize=(9.6, 4.6 if len(recording.joints) > CROWDED else 3.7), layout="constrained")
    panels = figure.subplots(1, 3 if arm else 2)
    goal = targets(recording)
    top = CLOSE_UP * float(goal.max())
    plot_bars(panels[0], recording.joints, total, goal)
    panels[0].set_title("Machine and arm together")
    plot_bars(panels[1], recording.joints, total, goal, top)
    panels[1].set_title("Machine and arm together, close up")
    if arm:
        plot_bars(panels[2], recording.joints, arm, goal, top)
        panels[2].set_title("Arm alone, close up")
    panels[0].set_ylabel("left over [N·m]")
    legend(figure, panels[:1], "lower center", 4)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    alone = " The right panel contains only the errors of the arm's model." if len(_scores(recording)) > 1 else ""
    return (
        "Left over is the torque that the person would still have to add to be weightless, here at many postures that "
        "were not used for identification. A shorter bar is better; below the dashed line the arm counts as "
        "weightless. The bars compare no support of the arm, the support from a body table by height, mass and sex, "
        "and the support after identification. Errors of the machine's own model are included, because the person "
        f"feels them.{alone}"
    )


def plot_bars(
    ax: Axes,
    joints: tuple[str, ...],
    scores: Scores,
    goal: np.ndarray,
    top: float | None = None,
) -> None:
    """Draw one group of bars per joint; bars higher than `top` [N·m] are cut but keep their number."""
    stages = [stage for stage in STAGES if stage in scores] + [stage for stage in scores if stage not in STAGES]
    width, x = 0.8 / len(stages), np.arange(len(joints))
    ceiling = top or 1.15 * max(max(scores[stage]) for stage in stages)
    ax.hlines(goal, x - 0.45, x + 0.45, color=INK, ls=(0, (3, 2)), lw=1.2, label="target", zorder=3)
    for k, stage in enumerate(stages):
        label, colour = STAGES.get(stage, (stage, INK))
        left = x + (k - (len(stages) - 1) / 2) * width
        values = np.array(scores[stage], dtype=float)
        ax.bar(left, np.minimum(values, ceiling), 0.92 * width, color=colour, label=label)
        for position, value in zip(left, values, strict=True):
            if top or value > LABELLED_SHARE * ceiling:
                _write_value(ax, position, value, ceiling, colour)
    ax.set_ylim(0.0, ceiling)
    is_crowded = len(joints) > CROWDED
    labels = [joint_label(joint, " " if is_crowded else "\n") for joint in joints]
    ax.set_xticks(x, labels, fontsize=8, rotation=90 if is_crowded else 0)
    ax.tick_params(axis="x", length=0)


def _write_value(ax: Axes, x: float, value: float, ceiling: float, colour: str) -> None:
    """Write the number of a bar: above the bar, or inside if the bar reaches the ceiling."""
    inside = value > 0.9 * ceiling
    letters = "white" if inside and colour != ORANGE else INK
    box = {"facecolor": colour if inside else "white", "edgecolor": "none", "pad": 0.8}
    note(
        ax, f"{value:.2f}", (x, min(value, ceiling)), (0, -3 if inside else 3), ha="center",
        va="top" if inside else "bottom", fontsize=7, rotation=90, zorder=4, color=letters, bbox=box,
    )  # fmt: skip


def _scores(recording: Recording) -> dict:
    return recording.last("/result")["left_over_rms_Nm"]
