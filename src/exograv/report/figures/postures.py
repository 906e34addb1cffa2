"""Figure of arm and exoskeleton in a few postures of the run."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon

from exograv.recording import Recording
from exograv.recording.fields import Message
from exograv.report.style.colours import BLUE, ORANGE, PALE

VIEW_FROM_DEG = (-40.0, 14.0)
"""Direction of view: turned from straight ahead towards the side of the arm, and raised [deg].

The viewer stands in front, on the side of the arm.
"""

N_PANELS = 4
TRUNK_M = 0.50
HALF_SHOULDER_WIDTH_M = 0.19
HEAD_M = (0.19, 0.25)
"""Dimensions of a schematic body, which shows the forward direction only. No result depends on them."""


def draw(recording: Recording) -> Figure | None:
    """Draw oblique views of the postures that differ most, on one scale."""
    frames = distinct_frames(recording.messages("/skeleton"), N_PANELS)
    if not frames:
        return None
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    panels = figure.subplots(1, len(frames), sharex=True, sharey=True, squeeze=False)[0]
    for ax, frame in zip(panels, frames, strict=True):
        plot_posture(ax, frame, recording.settings.get("side", "right"))
        ax.set_title(f"at {frame['t']:.0f} s", fontweight="normal")
    panels[0].legend(loc="lower left", bbox_to_anchor=(-0.05, -0.14), ncols=2)
    figure.draw_without_rendering()  # The layout knows the panels' equal scales only after a first drawing.
    return figure


def explain(recording: Recording) -> str:
    """Return the caption that explains how to read the figure."""
    return (
        "The person sits in the machine and looks towards the viewer and to the side. Blue is the exoskeleton with its "
        "joints, orange the person's arm from shoulder to hand. The two lines differ, because cuffs are soft and the "
        "machine's shoulder is never exactly at the person's shoulder. The grey body is only there for orientation."
    )


def plot_posture(ax: Axes, frame: Message, side: str) -> None:
    """Draw one posture in oblique view."""
    exo, arm = np.array(frame["exo"]), np.array(frame["arm"])
    outward = 1.0 if side == "left" else -1.0
    # A line over two arms runs from hand to hand. The right shoulder is in its first half.
    plot_body(ax, arm[len(arm) // 2 - 1 if side == "both" else 0], outward)
    ax.plot(*projected(exo, outward).T, "-o", color=BLUE, lw=2.6, ms=4.5, label="exoskeleton", zorder=3)
    look = {"color": ORANGE, "lw": 6.0, "alpha": 0.75, "solid_capstyle": "round"}
    ax.plot(*projected(arm, outward).T, "-", label="arm", zorder=2, **look)
    ax.set_aspect("equal")
    ax.set_axis_off()


def projected(points: Float[np.ndarray, "point 3"], outward: float) -> Float[np.ndarray, "point 2"]:
    """Project points of the base frame to the picture, right and up [m]; `outward`: sign of y on the arm's side."""
    turn, rise = np.deg2rad(VIEW_FROM_DEG)
    turn *= -outward
    to_viewer = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    return points @ np.stack([right, np.cross(to_viewer, right)], axis=1)


def distinct_frames(frames: Sequence[Message], n: int) -> list[Message]:
    """Return up to `n` frames with the most different arm postures, in order of time; the first is always included."""
    if len(frames) <= n:
        return list(frames)
    kind = np.dtype((float, (np.size(frames[0]["arm"]),)))
    arms = np.fromiter((np.ravel(frame["arm"]) for frame in frames), kind, len(frames))
    chosen = [0]
    while len(chosen) < n:
        distance = np.min([np.linalg.norm(arms - arms[k], axis=1) for k in chosen], axis=0)
        chosen.append(int(np.argmax(distance)))
    return [frames[k] for k in sorted(chosen)]


def plot_body(ax: Axes, shoulder: Float[np.ndarray, " 3"], outward: float) -> None:
    """Draw a schematic person with the shoulder centre of the arm's side at `shoulder` [m]."""
    inward = np.array([0.0, -outward * 2 * HALF_SHOULDER_WIDTH_M, 0.0])
    hips = np.array([0.0, 0.0, -TRUNK_M])
    corners = np.array([shoulder, shoulder + inward, shoulder + 0.85 * inward + hips, shoulder + 0.15 * inward + hips])
    ax.add_patch(Polygon(projected(corners, outward), color=PALE, lw=8, joinstyle="round", zorder=0))
    neck = shoulder + 0.5 * inward + np.array([0.0, 0.0, 0.06 + HEAD_M[1] / 2])
    centre = projected(neck[None], outward)[0]
    ax.add_patch(Ellipse((float(centre[0]), float(centre[1])), *HEAD_M, color=PALE, zorder=0))
