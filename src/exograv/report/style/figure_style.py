"""Style of figures and their embedding in a page: plain words, few lines, the same colours for the same things."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from itertools import cycle
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from exograv.files import write_whole

from .colours import GREY, INK, JOINT_COLOURS, PALE, RED

PICTURE_DPI, JOURNAL_DPI = 120, 300
"""Resolution of a command's pictures, and of a study's figures and the touches in their SVG.

Touches are drawn as pixels in an SVG file, because thousands of shapes load too slowly.
"""

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
    "font.family": "DejaVu Sans",  # comes with matplotlib, so letters and files are the same on every machine
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

JOURNAL: Mapping[Any, Any] = MappingProxyType(
    {
        "figure.dpi": JOURNAL_DPI,
        "font.size": 8.0,
        "axes.titlesize": 8.5,
        "legend.fontsize": 7.5,
        "lines.linewidth": 1.2,
    }
)
"""Settings of a study's figures that differ from `STYLE`."""


@contextmanager
def house_style(more: Mapping[Any, Any] = MappingProxyType({})) -> Iterator[None]:
    """Give figures that are made and saved inside the same look, without any effect outside."""
    with mpl.rc_context({**STYLE, **more}):
        yield


def mark_simulated(figure: Figure, is_simulated: bool = True) -> Figure:
    """Write SIMULATED on a figure of simulated data, so that the word stays on every copy; return the figure."""
    if is_simulated:
        figure.suptitle("SIMULATED", x=0.995, ha="right", fontsize=7, fontweight="bold", color=RED)
    return figure


def inline_svg(figure: Figure, name: str, letters: str = "none") -> str:
    """Return the figure as an `<svg>` element; the same data give the same text.

    Args:
        figure: Figure in the house style.
        name: Name that is unique on the page, so that identifiers do not clash.
        letters: `none` for text that can be edited, `path` for shapes that need no font.
    """
    text, dpi = StringIO(), figure.dpi
    with mpl.rc_context({**STYLE, "svg.hashsalt": name, "svg.fonttype": letters}):
        # `savefig` would first draw everything once for the layout, and gives the same picture.
        canvas = FigureCanvasSVG(figure)
        canvas.print_svg(text, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    figure.dpi = dpi  # `print_svg` sets 72, which would change the positions of dots in later drawings.
    svg = text.getvalue()
    # Without a fixed width and height the picture takes the width of the page.
    return re.sub(
        r'(<svg [^>]*?) width="[^"]*"', r"\1", svg[svg.index("<svg ") :].replace(' height="', ' data-height="', 1)
    )


def write_picture(path: Path, draw: Callable[[], Figure]) -> Path:
    """Draw a figure in the house style into a PNG or SVG file, or replace it; its folder is created too.

    Raises:
        RecordingError: The file cannot be written.
    """
    with house_style({"svg.hashsalt": path.stem}):
        write_whole(path, _saving(draw(), path.suffix[1:], PICTURE_DPI))
    return path


def write_figure(folder: Path, name: str, figure: Figure) -> list[Path]:
    """Write a figure for a journal, as SVG with its size on paper and as PNG.

    Raises:
        RecordingError: The folder cannot be written.
    """
    width, height = 25.4 * figure.get_size_inches()
    sized = inline_svg(figure, name).replace("<svg ", f'<svg width="{width:.1f}mm" height="{height:.1f}mm" ', 1)
    write_whole(folder / f"{name}.svg", sized)
    write_whole(folder / f"{name}.png", _saving(figure, "png", JOURNAL_DPI))
    return [folder / f"{name}.{kind}" for kind in ("svg", "png")]


def _saving(figure: Figure, kind: str, dpi: int) -> Callable[[Path], None]:
    def save(path: Path) -> None:
        with path.open("wb") as file:
            figure.savefig(
                file, format=kind, dpi=dpi, metadata={"png": {"Software": None}, "svg": {"Date": None}}[kind]
            )

    return save


def legend(figure: Figure, panels: Iterable[Axes], place: str, columns: int, **look: Any) -> None:
    """Draw one legend for the lines of all panels, outside of the panels."""
    found = {text: one for ax in panels for one, text in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(list(found.values()), list(found), **{"loc": f"outside {place}", "ncols": columns} | look)


def blank(panels: Iterable[Axes]) -> None:
    """Hide panels without content."""
    for ax in panels:
        ax.set_axis_off()


def note(ax: Axes, text: str, at: tuple[Any, Any], offset: tuple[float | int, float | int], **look: Any) -> None:
    """Write a text at an offset [points] from a position in the data."""
    ax.annotate(text, at, offset, textcoords="offset points", **look)


def name_rows(ax: Axes, names: Sequence[str]) -> None:
    """Put one name on each row, the first on top, with a grid across the rows."""
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(visible=True, axis="x")
    ax.grid(visible=False, axis="y")


def joint_label(joint: str, separator: str = " ") -> str:
    """Return the name of a joint as it is shown in figures."""
    return joint.replace("_", separator)


def joint_colours(joints: tuple[str, ...]) -> list[str]:
    """Return one colour per joint, the same in all figures."""
    return [colour for colour, _ in zip(cycle(JOINT_COLOURS), joints, strict=False)]


def plain_log_axis(ax: Axes, values: Sequence[float] | np.ndarray) -> None:
    """Make the vertical axis logarithmic around the positive values, with plain numbers."""
    positive = np.asarray(values, float)
    positive = positive[np.isfinite(positive) & (positive > 0.0)]
    low, high = (positive.min() / 1.2, positive.max() * 1.2) if len(positive) else (1.0, 100.0)
    ax.set(yscale="log", ylim=(low, high))
    plain_ticks(ax.yaxis, np.array([low, high]))


def plain_ticks(axis: Axis, ends: np.ndarray) -> None:
    """Put plain numbers on a logarithmic axis between two values, with more numbers per decade on a short axis."""
    decades = np.log10(ends[1] / ends[0])
    digits = (1, 1.5, 2, 3, 4, 5, 7) if decades < 1.0 else (1, 2, 5) if decades < 3.0 else (1,)
    ticks = [digit * 10.0**e for e in range(-4, 6) for digit in digits]
    axis.set_ticks([tick for tick in ticks if ends[0] <= tick <= ends[1]])
    axis.set_ticks([], minor=True)
    axis.set_major_formatter(lambda value, _: f"{value:g}")


def thinned(n: int, most: int) -> np.ndarray:
    """Return at most `most` of the indices 0…n−1, evenly spaced, first and last included."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).astype(int)) if n else np.array([], dtype=int)


def averaged(t: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Average `t` (sample,) and `values` (sample, joint) over `bins` stretches of equal length."""
    size = max(1, len(t) // bins)
    n = len(t) // size
    return t[: n * size].reshape(n, size).mean(1), values[: n * size].reshape(n, size, -1).mean(1)
