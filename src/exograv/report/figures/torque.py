"""Figure of the measured torque against the torque that the model predicts."""

import numpy as np
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.recording.stored_ticks import last_seconds
from exograv.report.style.colours import BLUE, GREY
from exograv.report.style.figure_style import averaged, blank, joint_label, legend

STRETCH_S = 12.0
BINS = 500
"""Number of points of a curve, each the average of many ticks. Without averaging, noise would hide the curves."""


def draw(recording: Recording) -> Figure | None:
    """Draw the last seconds of the identification, one panel per joint."""
    ticks = _stretch(recording)
    if ticks is None or len(ticks) < BINS:
        return None
    joints = recording.joints
    rows = -(-len(joints) // 2)
    figure = Figure(figsize=(9.6, 0.5 + 1.6 * rows), layout="constrained")
    panels = figure.subplots(rows, 2, sharex=True, squeeze=False).ravel()
    t, measured = averaged(ticks["t"], ticks["tau_measured"], BINS)
    _, expected = averaged(ticks["t"], ticks["tau_feedforward"], BINS)
    for k, (ax, joint) in enumerate(zip(panels, joints, strict=False)):
        ax.plot(t, measured[:, k], color=GREY, lw=1.6, label="measured by the motors")
        ax.plot(t, expected[:, k], color=BLUE, lw=1.2, label="expected by the model")
        ax.set_title(joint_label(joint), fontsize=9)
        ax.set(ylabel="[N·m]", xlim=(t[0], t[-1]))
    blank(panels[len(joints) :])
    figure.supxlabel("time of the run [s]", fontsize=9)
    legend(figure, panels[:1], "upper center", 2)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    ticks = _stretch(recording)
    assert ticks is not None
    gap = np.sqrt(np.nanmean((ticks["tau_measured"] - ticks["tau_feedforward"]) ** 2, axis=0))
    words = ", ".join(f"{joint_label(joint)} {value:.2f}" for joint, value in zip(recording.joints, gap, strict=True))
    return (
        f"The last {STRETCH_S:.0f} seconds of the identification. Grey is the torque of the motors, blue the torque "
        "that the model of machine and arm predicts for this motion. Where the lines agree, the model explains the "
        f"measured torque. The remaining difference (RMS of single ticks: {words} N·m) is noise, muscle activity of "
        "the wearer and model error. The curves are averages over short stretches and therefore smoother."
    )


def _stretch(recording: Recording) -> np.ndarray | None:
    """Return the last ticks of the identification; None without one."""
    return last_seconds(recording.phase_pieces("identify", ("t", "tau_measured", "tau_feedforward")), STRETCH_S)
