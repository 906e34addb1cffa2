"""How figures look, and how they enter a page: plain words, few lines, the same colours for the same things."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from itertools import cycle
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

# Okabe and Ito's palette, which colour-blind readers can tell apart.
BLUE, ORANGE, GREEN, RED, PINK, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
INK, GREY, PALE = "#22303C", "#8B96A1", "#E3E8EC"

JOINT_COLOURS = (BLUE, RED, PINK, GREEN, ORANGE, SKY, INK)

STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": INK,
    "axes.prop_cycle": cycler(color=JOINT_COLOURS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "figure.dpi": 100,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters, and the same file, on every machine
    "font.size": 9,
    "grid.color": PALE,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "path.simplify_threshold": 0.5,
    "svg.fonttype": "none",
    "text.color": INK,
    "text.parse_math": False,  # a name may hold a dollar sign
    "xtick.color": INK,
    "ytick.color": INK,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Figures made and saved inside look alike; nothing outside changes."""
    with mpl.rc_context(STYLE):
        yield


def mark_simulated(figure: Figure) -> None:
    """Nobody took part: it has to stand on the figure wherever it is copied to."""
    figure.suptitle("SIMULATED", x=0.995, ha="right", fontsize=7, fontweight="bold", color=RED)


def inline_svg(figure: Figure, name: str, letters: str = "none") -> str:
    """The figure as an `<svg>` element: same data, same text.

    Args:
        figure: Drawn in the house style.
        name: Tells the figures of one page apart: their identifiers must not clash.
        letters: `none` for text that can be edited, `path` for shapes that need no font.
    """
    text = StringIO()
    with mpl.rc_context({**STYLE, "svg.hashsalt": name, "svg.fonttype": letters}):
        # `savefig` would draw everything once before, to lay it out, and gives the same picture.
        canvas = FigureCanvasSVG(figure)
        canvas.print_svg(text, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    svg = text.getvalue()
    # Without fixed width and height the picture follows the width of the page.
    return re.sub(
        r'(<svg [^>]*?) width="[^"]*"', r"\1", svg[svg.index("<svg ") :].replace(' height="', ' data-height="', 1)
    )


def joint_label(joint: str, separator: str = " ") -> str:
    """`shoulder_flexion` in words."""
    return joint.replace("_", separator)


def joint_colours(joints: tuple[str, ...]) -> list[str]:
    """One colour a joint, the same in all figures."""
    return [colour for colour, _ in zip(cycle(JOINT_COLOURS), joints, strict=False)]


def plain_log_axis(ax: Axes, values: np.ndarray) -> None:
    """A logarithmic vertical axis whose ticks are read as plain numbers."""
    positive = values[np.isfinite(values) & (values > 0)]
    ax.set_yscale("log")
    ticks = [m * 10.0**e for e in range(-4, 4) for m in (1, 2, 5)]
    low, high = (positive.min() / 1.3, positive.max() * 1.3) if len(positive) else (0.01, 10.0)
    ax.set_ylim(low, high)
    ax.set_yticks([tick for tick in ticks if low <= tick <= high])
    ax.set_yticks([], minor=True)
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")


def thinned(n: int, most: int) -> np.ndarray:
    """At most `most` of the indices 0…n−1, evenly spread, first and last included."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).astype(int)) if n else np.array([], dtype=int)


def averaged(t: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of `t` (sample,) and of `values` (sample, joint) over `bins` stretches of equal length."""
    size = max(1, len(t) // bins)
    n = len(t) // size
    return t[: n * size].reshape(n, size).mean(1), values[: n * size].reshape(n, size, -1).mean(1)
