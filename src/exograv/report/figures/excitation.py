"""Figure of the identification motion: one period, with the range of each joint."""

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from exograv.report.style.colours import PALE
from exograv.report.style.figure_style import joint_colours, joint_label


def draw(
    joints: tuple[str, ...], q: Float[np.ndarray, "tick joint"], dt: float, limits_deg: tuple[list[float], list[float]]
) -> Figure:
    """Draw one panel per joint, with the allowed range behind the motion.

    Args:
        joints: Names of the joints.
        q: One period [rad].
        dt: Interval between rows [s].
        limits_deg: Lower and upper end of each joint's range.
    """
    figure = Figure(figsize=(7.2, 1.3 * len(joints)), layout="constrained")
    panels = figure.subplots(len(joints), 1, sharex=True, squeeze=False)[:, 0]
    t = np.arange(1, len(q) + 1) * dt
    for ax, joint, angle, colour, low, high in zip(
        panels, joints, np.rad2deg(q).T, joint_colours(joints), *limits_deg, strict=True
    ):
        ax.axhspan(low, high, color=PALE, zorder=0)
        ax.plot(t, angle, color=colour)
        ax.set_ylabel("°", rotation=0)
        ax.set_title(joint_label(joint), fontweight="normal")
    panels[-1].set_xlabel("time, s")
    return figure
