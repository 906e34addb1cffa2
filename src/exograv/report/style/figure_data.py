"""Numbers of a figure as comma-separated values, taken from the figure itself so that both always agree."""

from collections.abc import Iterable, Iterator
from itertools import chain
from urllib.parse import quote

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PathCollection, PolyCollection
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

Points = Iterable[tuple[float, float]]
UNSAFE = '%"<>&#\n\r'
"""Characters that a data link has to escape."""
SAFE = "".join(chr(code) for code in range(32, 127) if chr(code) not in UNSAFE)


def figure_csv(figure: Figure) -> str:
    """Return all points that a figure draws, one per line; empty if it draws none.

    Comment lines name the panels and their axes. A series is a curve, a group of bars (position and height), or a group
    of dots.
    """
    heads, rows = list[str](), list[str]()
    for number, ax in enumerate(figure.axes, start=1):
        found = list(_series(ax))
        if not found:
            continue
        title = ax.get_title(loc="left") or ax.get_title()
        heads.append(f"# panel {number}: {_plain(title)}; x: {_plain(ax.get_xlabel())}; y: {_plain(ax.get_ylabel())}")
        rows += [f"{number},{name},{x:.6g},{y:.6g}" for name, points in found for x, y in points]
    return "\n".join([*heads, "panel,series,x,y", *rows]) + "\n" if rows else ""


def data_link(text: str) -> str:
    """Return a text as an address that holds its content."""
    return "data:text/csv;charset=utf-8," + quote(text, safe=SAFE)


def _series(ax: Axes) -> Iterator[tuple[str, Points]]:
    """Yield name and points of each curve, group of bars and group of dots in the coordinates of the data."""
    number = 0
    for artist in chain(ax.lines, ax.containers, ax.collections):
        if isinstance(artist, Line2D | Collection) and not _is_in_data(ax, artist):
            continue
        points = _points(artist)
        if points:
            number += 1
            # A label that begins with an underscore is not in the legend; Matplotlib gives unnamed artists "_child…".
            label = str(artist.get_label())
            is_named = not label.startswith("_child") and label not in ("", "None", "_nolegend_")
            yield (_plain(label.removeprefix("_")) if is_named else f"{number}"), points


def _is_in_data(ax: Axes, artist: Line2D | Collection) -> bool:
    """Return True if both coordinates of an artist are data; a line across the whole panel is not."""
    if isinstance(artist, Line2D | LineCollection | PolyCollection):
        return all(artist.get_transform().contains_branch_seperately(ax.transData))
    return True


def _points(artist: object) -> list[tuple[float, float]]:
    if isinstance(artist, Line2D):
        return _pairs(np.asarray(artist.get_xydata(), float))
    if isinstance(artist, BarContainer):
        return [(bar.get_x() + bar.get_width() / 2, bar.get_height()) for bar in artist.patches]
    if isinstance(artist, PathCollection):
        return _pairs(np.ma.filled(np.ma.asarray(artist.get_offsets(), float), np.nan))
    if isinstance(artist, LineCollection | PolyCollection):
        return [pair for path in artist.get_paths() for pair in _pairs(np.asarray(path.vertices, float))]
    return []


def _pairs(points: np.ndarray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in points.tolist() if np.isfinite([x, y]).all()]


def _plain(text: str) -> str:
    return " ".join(text.replace(",", " ").replace('"', "'").split())
