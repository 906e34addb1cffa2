"""Does the released arm stay where it was left?"""

import numpy as np
from matplotlib.figure import Figure

from exograv.recording import Recording
from exograv.report.style.figure_style import joint_colours, joint_label, thinned

MOST_POINTS = 400


def draw(recording: Recording) -> Figure | None:
    """Angle of each joint since the release."""
    ticks = recording.phase_ticks("float")
    if len(ticks) < 2:
        return None
    ticks = ticks[thinned(len(ticks), MOST_POINTS)]
    figure = Figure(figsize=(9.6, 2.9), layout="constrained")
    ax = figure.subplots()
    moved = np.rad2deg(ticks["q_measured"] - ticks["q_measured"][0])
    for joint, values, colour in zip(recording.joints, moved.T, joint_colours(recording.joints), strict=True):
        ax.plot(ticks["t"] - ticks["t"][0], values, color=colour, label=joint_label(joint))
    # A wider view than the drift itself: a thousandth of a degree must not look like a fall.
    reach = max(2.0, 1.15 * float(np.abs(moved).max()))
    ax.set(
        ylim=(-reach, reach),
        xlim=(0.0, ticks["t"][-1] - ticks["t"][0]),
        xlabel="since the arm was let go [s]",
        ylabel="moved [°]",
    )
    ax.legend(loc="upper left", ncols=4)
    return figure


def explain(recording: Recording) -> str:
    """What one sees."""
    floated = recording.last("/result").get("float") or {}
    drift = floated.get("drift_deg")
    largest = (
        f" The largest drift was {max(np.abs(drift)):.1f}° in {floated['window_s']:.0f} s." if drift is not None else ""
    )
    return (
        "The person relaxes completely and the machine lets the arm go. Lines that stay flat mean that the arm floats; "
        f"a line that runs away means that too much or too little weight is taken.{largest} Friction of the drives "
        "also holds an arm, so read this picture together with what is left over."
    )
