"""Draw docs/pictures/floating.gif: the arm of a simulated wearer is released with and without weight compensation.

    python benchmarks/moving_picture.py

Both flights are of one machine and wearer (level 2), identified in 20 s of motion. Poses come from the recordings; the
torso, the head and the other arm are drawn around them.
"""

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon
from PIL import Image

import exograv

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "floating.gif"
RIG, LEVEL, SEED = "recupera_like", 2, 1
SECONDS, FRAMES_PER_S = 4.0, 20
"""Flight [s]; recordings hold 20 poses a second."""
HOLD_FRAMES = 20
SKIN, SHIRT, MACHINE, CUFF, GREY = "#d9a37e", "#7c97b8", "#2b3a4a", "#d1495b", "#9aa5b1"
AZIMUTH, ELEVATION = np.deg2rad(-125.0), np.deg2rad(12.0)
"""Direction of view: from the front right, a little from above [rad]."""
SHOULDER = np.array([-0.01, -0.2, 0.5])
"""Right shoulder in the frame of the machine's base [m]."""
POINTS_PER_M = 260.0


def projected(points: np.ndarray) -> np.ndarray:
    """Project points (point, 3) [m] on the picture (point, 2) [m]."""
    forward = np.array([np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)])
    right = np.cross([0.0, 0.0, 1.0], forward)
    right /= np.linalg.norm(right)
    return np.column_stack([points @ right, points @ np.cross(forward, right)])


def limb(axes, points, width_m: float, colour: str, order: float, ends: str = "round") -> None:
    """Draw a chain of segments."""
    x, y = projected(np.asarray(points, dtype=float)).T
    axes.plot(x, y, lw=width_m * POINTS_PER_M, color=colour, solid_capstyle=ends, solid_joinstyle="round",
              zorder=order)  # fmt: skip


def person(axes) -> None:
    """Draw the parts of the wearer that do not move: head, torso, left arm, thighs, seat."""
    left = SHOULDER * [1.0, -1.0, 1.0]
    hip = np.array([0.0, 0.0, -0.05])
    limb(
        axes,
        [
            left + np.array([0.0, 0.01, -0.02]),
            left + np.array([0.02, 0.06, -0.28]),
            left + np.array([0.24, 0.0, -0.36]),
        ],
        0.075,
        SKIN,
        1.0,
    )
    limb(axes, [left, left + np.array([0.01, 0.03, -0.14])], 0.095, SHIRT, 1.1)
    for side in (1.0, -1.0):
        limb(
            axes,
            [hip + np.array([0.0, 0.09 * side, 0.0]), hip + np.array([0.42, 0.11 * side, 0.02])],
            0.13,
            "#55606e",
            0.5,
        )
    corners = [
        hip + np.array([0.0, 0.09, 0.0]),
        hip + np.array([0.0, -0.09, 0.0]),
        [0.0, -0.14, 0.46],
        [0.0, 0.14, 0.46],
    ]
    outline = projected(np.array(corners))
    axes.add_patch(Polygon(outline, color=SHIRT, lw=0.14 * POINTS_PER_M, joinstyle="round", zorder=2.0))
    limb(axes, [[0.0, 0.0, 0.5], [0.01, 0.0, 0.58]], 0.085, SKIN, 1.9)
    x, y = projected(np.array([[0.03, 0.0, 0.7]]))[0]
    axes.add_patch(Ellipse((x, y), 0.16, 0.21, color=SKIN, zorder=2.2))
    limb(axes, [[-0.17, 0.0, -0.14], [-0.17, 0.0, 0.5]], 0.05, MACHINE, 0.2)
    limb(axes, [[-0.17, 0.0, 0.5], [-0.12, -0.24, 0.52], SHOULDER + np.array([0.0, -0.04, 0.03])], 0.045, MACHINE, 2.5)


def frame(axes, pose, title: str, colour: str) -> None:
    """Draw one pose of machine and arm."""
    axes.cla()
    axes.set(xlim=(-0.42, 0.66), ylim=(-0.26, 0.86), aspect="equal")
    axes.axis("off")
    axes.set_title(title, fontsize=12, color=colour, pad=2)
    person(axes)
    shoulder, elbow, wrist, tip = (np.array(point) for point in pose["arm"])
    limb(axes, [shoulder, elbow, wrist], 0.075, SKIN, 3.0)
    limb(axes, [wrist, tip], 0.055, SKIN, 3.0)
    limb(axes, [shoulder, 0.5 * (shoulder + elbow)], 0.1, SHIRT, 3.1)
    outside = np.array([0.0, -0.06, 0.0])
    exo = [np.array(point) + outside for point in pose["exo"][3:]]
    limb(axes, exo, 0.03, MACHINE, 3.5)
    for joint in exo[:2]:
        x, y = projected(joint[None])[0]
        axes.add_patch(Ellipse((x, y), 0.07, 0.07, color=MACHINE, zorder=3.6))
    for a, b in ((shoulder, elbow), (elbow, wrist)):
        middle = a + 0.62 * (b - a)
        limb(axes, [middle - 0.08 * (b - a), middle + 0.08 * (b - a)], 0.1, CUFF, 3.4, ends="butt")


def poses(path: Path) -> list[dict]:
    """Poses of the flight in a recording."""
    recording = exograv.Recording(path)
    start = recording.to_pandas("/phase")["t"].iloc[-1]
    table = recording.to_pandas("/skeleton")
    return table[table["t"] >= start].to_dict("records")


def main() -> None:
    """Fly, draw, write."""
    twin = exograv.Twin(exograv.load_rig(RIG), level=LEVEL, seed=SEED)
    with tempfile.TemporaryDirectory() as spare:
        floating, falling = Path(spare) / "floating.mcap", Path(spare) / "falling.mcap"
        first = exograv.float_arm(twin, identify_s=20.0, seconds=SECONDS, path=floating)
        exograv.float_arm(twin, first.estimate, gravity_level=1.0, seconds=SECONDS, path=falling)
        pairs = list(zip(poses(falling), poses(floating), strict=False))
    figure = Figure(figsize=(7.6, 4.1), dpi=84)
    left, right = figure.subplots(1, 2)
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.92, wspace=0.0)
    images = []
    for number, (drop, float_) in enumerate([pairs[0]] * 10 + pairs + [pairs[-1]] * HOLD_FRAMES):
        frame(left, drop, "released: the arm carries its own weight", CUFF)
        frame(right, float_, "released: exograv carries the arm", "#1b7f5c")
        figure.canvas.draw() if number == 0 else None
        path = Path(tempfile.gettempdir()) / "frame.png"
        figure.savefig(path)
        images.append(Image.open(path).convert("P", palette=Image.Palette.ADAPTIVE, colors=48).copy())
    PICTURE.parent.mkdir(exist_ok=True)
    images[0].save(PICTURE, save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_S, loop=0)
    print(f"{PICTURE}: {len(images)} frames, {PICTURE.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
