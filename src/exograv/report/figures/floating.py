"""Figure of the released arm: its drift from the position of release."""

import numpy as np
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.recording.stored_ticks import rows_at
from exograv.report.style.figure_style import joint_colours, joint_label, thinned

MOST_POINTS = 400


def draw(recording: Recording) -> Figure | None:
    """Draw the angle of each joint since the release."""
    length = recording.phase_length("float")
    if length < 2:
        return None
    ticks = rows_at(recording.phase_pieces("float", ("t", "q_measured")), thinned(length, MOST_POINTS))
    figure = Figure(figsize=(9.6, 2.9), layout="constrained")
    ax = figure.subplots()
    moved = np.rad2deg(ticks["q_measured"] - ticks["q_measured"][0])
    for joint, values, colour in zip(recording.joints, moved.T, joint_colours(recording.joints), strict=True):
        ax.plot(ticks["t"] - ticks["t"][0], values, color=colour, label=joint_label(joint))
    # The view is wider than the drift itself, because a thousandth of a degree must not look like a fall.
    reach = max(2.0, 1.15 * float(np.abs(moved).max()))
    ax.set(
        ylim=(-reach, reach),
        xlim=(0.0, ticks["t"][-1] - ticks["t"][0]),
        xlabel="time since the release [s]",
        ylabel="drift [°]",
    )
    ax.legend(loc="upper left", ncols=4)
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    floated = recording.last("/result").get("float") or {}
    drift = floated.get("drift_deg")
    largest = (
        f" The largest drift was {max(np.abs(drift)):.1f}° in {floated['window_s']:.0f} s." if drift is not None else ""
    )
    return (
        "The person relaxes completely and the machine releases the arm. A flat line means that the arm floats. A line "
        f"that drifts away means that too much or too little weight is carried.{largest} Friction of the drives also "
        "holds a still arm, so a small drift says little; the left over says more."
    )
