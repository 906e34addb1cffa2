"""Figure of a run among other simulated wearers, by true left over."""

import numpy as np
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.recording.fields import Message
from exograv.report.style.colours import BLUE, GREY, INK
from exograv.report.style.figure_style import joint_label, legend, name_rows
from exograv.study.targets import targets

SPREAD = 0.5
"""Height of a row over which the dots of the others are spread, so that equal values are visible [-]."""


def draw(recording: Recording) -> Figure | None:
    """Draw one row per joint: a dot for each other wearer, a diamond for this run, and the target."""
    others = np.array(_comparison(recording).get("others_Nm") or [])
    if not others.size:
        return None
    own = (recording.last("/result").get("left_over_rms_Nm") or {})["total"]["identified"]
    figure = Figure(figsize=(9.6, 1.1 + 0.42 * len(own)), layout="constrained")
    ax = figure.subplots()
    rows = np.arange(len(own))
    offsets = SPREAD * ((0.618 * np.arange(len(others))) % 1.0 - 0.5)  # evenly spread, in no visible order
    for k, joint in enumerate(recording.joints):
        # The legend leaves out names that begin with an underscore; the figure's data have them all.
        label = "other wearers" if k == 0 else f"_other wearers: {joint_label(joint)}"
        ax.plot(others[:, k], k + offsets, "o", ms=4, mew=0, alpha=0.6, color=GREY, label=label)
    ax.plot(own, rows, "D", ms=7, color=BLUE, label="this run")
    goal = targets(recording)
    ax.vlines(goal, rows - 0.4, rows + 0.4, color=INK, ls=(0, (3, 2)), lw=1.2, label="target")
    name_rows(ax, [joint_label(joint) for joint in recording.joints])
    ax.set(xlim=(0.0, 1.08 * max(float(others.max()), *own, float(goal.max()))), xlabel="left over [N·m]")
    legend(figure, [ax], "upper right", 3)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    return (
        "Each dot is another simulated wearer in another machine, drawn at the same disturbance level and identified "
        "in the same way; the diamond is this run. Further left is better. The other wearers were simulated on "
        f"{_comparison(recording)['date']}."
    )


def _comparison(recording: Recording) -> Message:
    return recording.last("/result").get("comparison") or {}
