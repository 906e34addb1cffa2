"""Figure of the muscle effort of one movement in each condition, by joint, one panel per kind of drive."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREEN, GREY, INK, ORANGE, RED, SKY
from exograv.report.style.figure_style import joint_colours, joint_label, legend, note

from .transparency_data import MachineTransparency

CONDITIONS = {
    "uncompensated": "motors\noff",
    "gcm": "machine\ncarried",
    "dam": "+ arm,\nidentified",
    "dam_ideal": "+ arm,\ntruth known",
    "dam_ideal_no_friction": "same, no\nfriction",
    "zero_g": "0 g, no\nmachine",
}
"""Words by condition, in the order of decreasing effort."""

PROFILES = {"harmonic": "harmonic drives", "qdd": "quasi-direct drives"}

GOALS = {"harmonic": {"effort": 0.5, "elbow": 0.6}, "qdd": {"effort": 0.25}}
"""Goal for the effort with the arm carried too, as a share of the effort with only the machine carried [-]."""

STEPS = (
    ("zero_g", "own inertia and elasticity", GREEN),
    ("dam_ideal_no_friction", "inertia of the machine", SKY),
    ("dam_ideal", "friction", RED),
    ("dam", "errors of calibration and identification", BLUE),
    ("gcm", "weight of the arm", ORANGE),
    ("uncompensated", "weight of the machine", GREY),
)
"""Load that each condition adds to the one before."""


def draw_effort(results: Sequence[MachineTransparency]) -> Figure:
    """Draw medians stacked by joint; dots are single machines, the dashed line is the goal."""
    return _panels(results, _plot_effort, 4.2, 5)


def draw_causes(results: Sequence[MachineTransparency]) -> Figure:
    """Draw the difference between each condition and the one with one load less, joint by joint."""
    return _panels(results, _plot_causes, 3.6, 3)


def _panels(
    results: Sequence[MachineTransparency],
    plot: Callable[[Axes, MachineTransparency], None],
    height: float,
    columns: int,
) -> Figure:
    figure = Figure(figsize=(4.8 * max(2, len(results)), height), layout="constrained")
    panels = figure.subplots(1, len(results), sharey=True, squeeze=False)[0]
    for ax, result in zip(panels, results, strict=True):
        plot(ax, result)
        ax.tick_params(axis="x", length=0)
        ax.set_title(PROFILES[result.profile])
    panels[0].set_ylabel("effort [N·m·s]")
    legend(figure, panels[:1], "lower center", columns)
    return figure


def _plot_effort(ax: Axes, result: MachineTransparency) -> None:
    conditions = [name for name in CONDITIONS if name in result.conditions]
    x = np.arange(len(conditions))
    bottom = np.zeros(len(conditions))
    for k, (joint, colour) in enumerate(zip(result.joints, joint_colours(tuple(result.joints)), strict=True)):
        height = np.array([result.conditions[name].by_joint_Nms[k] for name in conditions])
        ax.bar(x, height, 0.62, bottom=bottom, color=colour, label=joint_label(joint))
        bottom += height
    for position, name in zip(x, conditions, strict=True):
        totals = [machine.effort_Nms for machine in result.conditions[name].machines]
        beside = 0.07 * (np.arange(len(totals)) - (len(totals) - 1) / 2)
        ax.plot(position + beside, totals, "o", color=INK, ms=3, zorder=4)
        effort = f"{result.conditions[name].effort_Nms:.0f}"
        note(ax, effort, (position, max(totals)), (0, 5), ha="center", fontsize=9)
    goal = GOALS.get(result.profile, {}).get("effort")
    if goal is not None and "dam" in conditions:
        height = goal * result.conditions["gcm"].effort_Nms
        at = conditions.index("dam")
        ax.hlines(height, at - 0.45, at + 0.45, color=INK, ls=(0, (3, 2)), lw=1.4, zorder=5, label="goal")
    ax.set_xticks(x, [CONDITIONS[name] for name in conditions], fontsize=8)


def _plot_causes(ax: Axes, result: MachineTransparency) -> None:
    x, before = np.arange(len(result.joints)), np.zeros(len(result.joints))
    width = 0.8 / len(STEPS)
    for k, (name, words, colour) in enumerate(STEPS):
        after = np.array(result.conditions[name].by_joint_Nms)
        ax.bar(x + (k - (len(STEPS) - 1) / 2) * width, after - before, 0.9 * width, color=colour, label=words)
        before = after
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set_xticks(x, [joint_label(joint, "\n") for joint in result.joints], fontsize=8)
