"""Figure of the identification's progress: true left over, if an examiner knows it, and the machine's prediction."""

from collections.abc import Iterable, Iterator
from itertools import islice

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.recording.fields import Message
from exograv.report.style.colours import INK
from exograv.report.style.figure_style import joint_colours, joint_label, note, plain_log_axis, thinned
from exograv.study.targets import targets

MOST_POINTS = 150


def draw(recording: Recording) -> Figure | None:
    """Draw the left over per joint against the seconds of motion."""
    if len(recording.messages("/left_over")) < 2 and sum(1 for _ in islice(_beliefs(recording), 2)) < 2:
        return None
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    plot_progress(figure.subplots(), recording)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    words = (
        "While the arm moves, the machine identifies its weight. Each colour is one joint; lower is better. On this "
        "scale equal steps down mean equal factors. Dashed lines are the targets."
    )
    if recording.messages("/left_over"):
        time = (recording.last("/result").get("identification") or {}).get("time_to_target_s")
        words += " Solid lines are the true values, which only the examiner of the twin knows, not the machine."
        words += f" From {time:.0f} s on, all joints stayed below their targets." if time is not None else ""
    if any(True for _ in _beliefs(recording)):
        words += " Dotted lines are the left over that the machine itself predicts."
    return words


def plot_progress(ax: Axes, recording: Recording) -> None:
    """Draw the left over of each joint against seconds of motion.

    True values are solid, predicted values dotted, targets dashed.
    """
    true = _curve(recording.messages("/left_over"), "total")
    expected = _curve(_beliefs(recording), "predicted_left_over_Nm")
    for k, (joint, colour) in enumerate(zip(recording.joints, joint_colours(recording.joints), strict=True)):
        label = joint_label(joint)
        if len(expected):
            # The legend leaves out names that begin with an underscore.
            dotted = f"_{label}: predicted" if len(true) else label
            ax.plot(expected[:, 0], expected[:, 1 + k], ":", lw=1.1, color=colour, label=dotted)
        if len(true):
            ax.plot(true[:, 0], true[:, 1 + k], "-", marker=".", ms=4, color=colour, label=label)
    shown = true if len(true) else expected
    _mark_targets(ax, targets(recording))
    plain_log_axis(ax, np.concatenate([shown[:, 1:].ravel(), targets(recording)]))
    ax.set(xlim=(0.0, shown[-1, 0]), xlabel="motion since the identification began [s]", ylabel="left over [N·m]")
    ax.legend(loc="upper right", ncols=2)


def _mark_targets(ax: Axes, goal: np.ndarray) -> None:
    for value in np.unique(goal):
        ax.axhline(value, color=INK, ls=(0, (3, 2)), lw=1.1)
        note(
            ax,
            f"target\n{value:g}",
            (1.0, value),
            (4, 0),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=7.5,
        )


def _beliefs(recording: Recording) -> Iterator[Message]:
    return (message for message in recording.messages("/estimate") if message.get("predicted_left_over_Nm"))


def _curve(messages: Iterable[Message], name: str) -> np.ndarray:
    """Return rows with seconds of motion and one value per joint."""
    rows = np.array([[message["motion_s"], *message[name]] for message in messages])
    return rows[thinned(len(rows), MOST_POINTS)]
