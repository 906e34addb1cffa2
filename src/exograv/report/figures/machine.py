"""Overview of a machine: the arm in the machine, the reach of the finger tip, and the torque reserve of each drive."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Ellipse

from exograv.report.style.colours import BLUE, GREEN, GREY, INK, ORANGE, PALE, PINK, RED, SKY
from exograv.report.style.figure_style import joint_label, legend

from .machine_data import DrawnArm, MachinePicture, Points, TorqueRow
from .postures import HALF_SHOULDER_WIDTH_M, HEAD_M, plot_body, projected

PARTS = {
    "exo": ("machine", BLUE),
    "arm": ("arm", ORANGE),
    "hand_1kg": ("1 kg in the hand", PINK),
    "friction": ("friction to break away", GREY),
}
"""Words and colour by origin of a torque."""

Seen = Float[np.ndarray, "point 2"]


def draw(check: MachinePicture) -> Figure:
    """Draw front view, top view, and torque joint by joint."""
    height = max(4.6, 1.8 + 0.42 * len(check.torque_Nm))
    figure = Figure(figsize=(13.0, height), layout=ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08))
    front, above, bars = figure.subplots(1, 3, width_ratios=(1.0, 0.95, 1.2))
    figure.suptitle(f"{check.title}\n{_verdict(check)}", x=0.01, ha="left", color=INK)
    plot_front(front, check.arms, check.voxel_m)
    plot_above(above, check.arms, check.voxel_m)
    plot_torque(bars, check.torque_Nm)
    front.set_title("Front view with the cuffs")
    above.set_title("Top view, forward is up")
    bars.set_title("Torque at rest in the task's worst posture [N·m]")
    legend(figure, [front], "lower left", 6, columnspacing=1.4)
    legend(figure, [bars], "lower right", 4, columnspacing=1.2, handlelength=1.2)
    return figure


def _verdict(check: MachinePicture) -> str:
    held = f"The cuffs constrain {check.rank} of {check.human_dof} degrees of freedom"
    wearer = f"this wearer's arm weighs {check.wearer_arm_kg:.1f} kg"
    if all(row.limit is None for row in check.torque_Nm):
        return f"{held}; no motors; {wearer}."
    return f"{held}; the drives hold an arm of {check.largest_arm_kg:.1f} kg with 1 kg in the hand; {wearer}."


def plot_front(ax: Axes, arms: Sequence[DrawnArm], voxel_m: float) -> None:
    """Draw machine and arm in oblique view, with the reach of the finger tip behind them."""
    outward = 1.0 if arms[0].side == "left" else -1.0
    plot_body(ax, arms[0].arm[0], outward)
    _plot_arms(ax, arms, lambda points: projected(points, outward), voxel_m)


def plot_above(ax: Axes, arms: Sequence[DrawnArm], voxel_m: float) -> None:
    """Draw machine and arm from above; the wearer's right is on the right."""
    shoulder = arms[0].arm[0]
    inward = 1.0 if arms[0].side == "right" else -1.0
    middle = (-float(shoulder[1] + inward * HALF_SHOULDER_WIDTH_M), float(shoulder[0]))
    ax.add_patch(Ellipse(middle, 2 * HALF_SHOULDER_WIDTH_M, 0.22, color=PALE, zorder=0))
    ax.add_patch(Ellipse(middle, HEAD_M[0], HEAD_M[1], color="white", ec=GREY, lw=0.8, zorder=1))
    _plot_arms(ax, arms, lambda points: points[:, [1, 0]] * [-1.0, 1.0], voxel_m)


def plot_torque(ax: Axes, rows: Sequence[TorqueRow]) -> None:
    """Draw one bar per joint: the required torque by origin, against the limit of the drive."""
    places = np.arange(len(rows))[::-1]
    forward, backward = np.zeros(len(rows)), np.zeros(len(rows))
    signs = np.array([np.sign(row.exo + row.arm + row.hand_1kg) or 1.0 for row in rows])
    for name, (label, colour) in PARTS.items():
        # Friction opposes motion in either direction.
        part = np.array([getattr(row, name) for row in rows]) * (1.0 if name == "friction" else signs)
        start = np.where(part >= 0.0, forward, backward)
        ax.barh(places, part, left=start, height=0.62, color=colour, label=label)
        forward, backward = forward + np.maximum(part, 0.0), backward + np.minimum(part, 0.0)
    limits = [row.limit for row in rows]
    for place, limit, load in zip(places, limits, forward, strict=True):
        if limit is not None:
            ax.plot([limit, limit], [place - 0.4, place + 0.4], color=RED if load > limit else INK, lw=2.2)
        words = "no motor" if limit is None else f"{limit:g} N·m"
        at = (load if limit is None else limit, place)
        ax.annotate(words, at, (5, 0), textcoords="offset points", va="center")
    most = max([*forward, *(limit for limit in limits if limit is not None)])
    ax.set_xlim(min(1.15 * backward.min(), -0.01 * most), 1.25 * most)
    ax.set_yticks(places, [joint_label(row.joint) for row in rows])
    ax.grid(visible=False, axis="y")
    ax.grid(visible=True, axis="x")


def _plot_arms(ax: Axes, arms: Sequence[DrawnArm], seen: Callable[[Points], Seen], voxel_m: float) -> None:
    """Draw all arms; `seen` maps points of the base frame to the picture."""
    for arm in arms:
        _plot_region(ax, seen(arm.reach), voxel_m, SKY, "reach of the fingertip")
        _plot_region(ax, seen(arm.task), voxel_m, GREEN, "in the task workspace")
        ax.plot(*seen(arm.arm).T, color=ORANGE, lw=6.0, alpha=0.85, solid_capstyle="round", label="arm", zorder=3)
        ax.plot(*seen(arm.exo).T, "-o", color=BLUE, lw=2.2, ms=4.5, label="machine", zorder=4)
        masses = {"s": 34.0 * arm.links[:, 3], "color": "none", "ec": BLUE, "lw": 1.2, "clip_on": False}
        ax.scatter(*seen(arm.links[:, :3]).T, label="link's mass", zorder=5, **masses)
        ax.plot(*seen(arm.cuffs).T, "s", color="white", mec=INK, mew=1.3, ms=6.5, label="cuff", zorder=6)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _plot_region(ax: Axes, points: Seen, voxel_m: float, colour: str, label: str) -> None:
    """Draw the area that is covered by the centres of voxels, with a smooth edge."""
    pad = 2.5 * voxel_m  # centres of voxels fall into centres of cells
    edges = [np.arange(low - pad, high + pad, voxel_m) for low, high in zip(points.min(0), points.max(0), strict=True)]
    counts, x, y = np.histogram2d(*points.T, bins=edges)
    filled = np.pad((counts > 0).astype(float), 1)
    # A mean over three by three cells rounds corners and closes gaps between centres that the oblique view opens.
    smooth = np.mean([np.roll(filled, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)[1:-1, 1:-1]
    middles = [0.5 * (edge[1:] + edge[:-1]) for edge in (x, y)]
    ax.contourf(*middles, smooth.T, levels=[0.4, 2.0], colors=[colour], alpha=0.22, zorder=1)
    ax.contour(*middles, smooth.T, levels=[0.4], colors=[colour], linewidths=0.8, alpha=0.8, zorder=1)
    ax.fill([], [], color=colour, alpha=0.3, label=label)
