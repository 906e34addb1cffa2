"""What is left of the weight: before and after, and while the machine learns."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording

from exograv.study.drawing import BLUE, GREY, INK, ORANGE, joint_colours, joint_label, plain_log_axis
from exograv.study.targets import targets

STAGES = {
    "exo_only": ("machine weight carried, arm not", GREY),
    "table": ("arm by table (height, mass, sex)", ORANGE),
    "identified": ("arm identified", BLUE),
}
"""Name in the recording: words and colour."""

CLOSE_UP = 5.0
"""The close-up ends at so many times the largest target [-]."""


def draw_bars(recording: Recording) -> Figure | None:
    """Left over per joint: everything, a close-up of it, and the arm alone."""
    scores = recording.last("/result").get("left_over_rms_Nm") or {}
    total, arm = scores.get("total") or {}, scores.get("arm") or {}
    if not total:
        return None
    figure = Figure(figsize=(9.6, 3.7), layout="constrained")
    panels = figure.subplots(1, 3 if arm else 2)
    goal = targets(recording)
    plot_bars(panels[0], recording.joints, total, goal)
    panels[0].set_title("Exoskeleton and arm together")
    plot_bars(panels[1], recording.joints, total, goal, top=CLOSE_UP * float(goal.max()))
    panels[1].set_title("The same, close up")
    if arm:
        plot_bars(panels[2], recording.joints, arm, goal, top=CLOSE_UP * float(goal.max()))
        panels[2].set_title("Arm alone, close up")
    panels[0].set_ylabel("left over [N·m]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def explain_bars(recording: Recording) -> str:
    """What one sees."""
    return (
        "At 200 postures that the machine never practised we ask: how much torque would the person still have to add to "
        "stay weightless? The shorter the bar, the better; below the dashed line the arm counts as weightless. Left: "
        "without any help for the arm, with the help that a body table suggests, and after the arm was identified. "
        "Right: errors of the arm's model alone; left and middle count the machine's own errors too, as the wearer feels them."
    )


def plot_bars(
    ax: Axes, joints: tuple[str, ...], scores: dict[str, list[float]], goal: np.ndarray, top: float | None = None
) -> None:
    """Groups of bars, one group a joint; bars higher than `top` [N·m] are cut and keep their number."""
    stages = [stage for stage in STAGES if stage in scores] + [stage for stage in scores if stage not in STAGES]
    width, x = 0.8 / len(stages), np.arange(len(joints))
    ceiling = top or 1.12 * max(max(scores[stage]) for stage in stages)
    for k, stage in enumerate(stages):
        label, colour = STAGES.get(stage, (stage, INK))
        left = x + (k - (len(stages) - 1) / 2) * width
        values = np.array(scores[stage], dtype=float)
        ax.bar(left, np.minimum(values, ceiling), 0.92 * width, color=colour, label=label)
        for position, value in zip(left, values, strict=True):
            text = f"{value:.2f}" if value < 9.995 else f"{value:.0f}"
            cut = value > 0.93 * ceiling
            ax.annotate(
                text,
                (position, min(value, ceiling)),
                xytext=(0, -2 if cut else 2),
                textcoords="offset points",
                ha="center",
                va="top" if cut else "bottom",
                fontsize=7,
                rotation=90,
                color="white" if cut and colour != ORANGE else INK,
            )
    ax.hlines(goal, x - 0.45, x + 0.45, color=INK, ls=(0, (3, 2)), lw=1.2, label="target")
    ax.set_ylim(0.0, ceiling)
    ax.set_xticks(x, [joint_label(joint, "\n") for joint in joints], fontsize=8)
    ax.tick_params(axis="x", length=0)


def draw_progress(recording: Recording) -> Figure | None:
    """Left over per joint against the seconds of motion."""
    if len(recording.messages("/left_over")) < 2:
        return None
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    plot_progress(figure.subplots(), recording)
    return figure


def explain_progress(recording: Recording) -> str:
    """What one sees."""
    time = recording.last("/result").get("identification", {}).get("time_to_target_s")
    reached = (
        f"After {time:.0f} s all joints stayed below their targets."
        if time is not None
        else "Not all joints stayed below their targets to the end."
    )
    return (
        "While the arm is moved, the machine learns its weight: each line is one joint, and lower is better. The scale "
        "is such that equal steps down mean equal factors. Dashed are the targets. The twin's examiner knows the truth and "
        f"draws these lines; the machine never sees them. {reached}"
    )


def plot_progress(ax: Axes, recording: Recording) -> None:
    """Left over (total) of each joint against seconds of motion, with the targets."""
    messages = recording.messages("/left_over")
    seconds = np.array([message["motion_s"] for message in messages])
    total = np.array([message["total"] for message in messages])
    for joint, values, colour in zip(recording.joints, total.T, joint_colours(recording.joints), strict=True):
        ax.plot(seconds, values, "-", marker=".", ms=4, color=colour, label=joint_label(joint))
    for goal in np.unique(targets(recording)):
        ax.axhline(goal, color=INK, ls=(0, (3, 2)), lw=1.1)
        ax.annotate(
            f"target {goal:g}", (1, goal), xycoords=("axes fraction", "data"), xytext=(-2, 2),
            textcoords="offset points", ha="right", va="bottom", fontsize=7.5,
        )  # fmt: skip
    plain_log_axis(ax, np.concatenate([total.ravel(), targets(recording)]))
    ax.set_xlim(0.0, seconds[-1])
    ax.set_xlabel("motion since the identification began [s]")
    ax.set_ylabel("left over [N·m]")
    ax.legend(loc="upper right", ncols=2)
