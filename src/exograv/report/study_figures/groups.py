"""What all figures of a study share: widths of journals, one colour and one marker a group, the word SIMULATED."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from exograv.report.style.figure_style import BLUE, GREEN, INK, ORANGE, PINK, SKY, mark_simulated
from exograv.study.measures.study_data import StudyData
from exograv.study.participants.participant_record import SEALED

WIDTH_1, WIDTH_2 = 85.0 / 25.4, 180.0 / 25.4
"""One column and two of a journal [inch]."""

DPI = 300
"""Of PNG, and of the touches within SVG: thousands of dots as shapes make a page that nobody can open."""

JOURNAL: dict[Any, Any] = {
    "figure.dpi": DPI,
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.2,
}


@dataclass(frozen=True)
class Look:
    """Of a group: told apart by colour, and without colour by marker, line and hatching."""

    colour: str
    marker: str
    line: str
    hatch: str


LOOKS = (
    Look(BLUE, "o", "-", ""),
    Look(ORANGE, "s", "--", "///"),
    Look(GREEN, "^", "-.", "..."),
    Look(PINK, "D", ":", "xxx"),
    Look(SKY, "v", "-", "\\\\\\"),
)
SEALED_LOOK = Look(INK, "D", "-", "")


def look(data: StudyData, group: str) -> Look:
    """The same in all figures of a study."""
    return SEALED_LOOK if group == SEALED else LOOKS[data.groups.index(group) % len(LOOKS)]


def label(group: str) -> str:
    """As a reader sees it."""
    return "all, groups sealed" if group == SEALED else group


def marked(figure: Figure, data: StudyData) -> Figure:
    """The figure, with what must stand on it wherever it is copied to."""
    if data.is_simulated:
        mark_simulated(figure)
    return figure


def second_axis_mm(ax: Axes, data: StudyData) -> None:
    """The same deviations in millimetres on the right; nothing where screens differ or were not calibrated."""
    pitch = data.pitch_mm
    if pitch is None:
        return
    right = ax.secondary_yaxis(
        "right", functions=(lambda px: pitch * np.asarray(px), lambda mm: np.asarray(mm) / pitch)
    )
    right.set_ylabel("deviation [mm]")
    right.spines["right"].set_visible(True)
    plain_ticks(right.yaxis, np.array(ax.get_ylim()) * pitch)


def plain_log(ax: Axes, values: Sequence[float] | np.ndarray) -> None:
    """A logarithmic axis of deviations, with plain numbers, around these values."""
    positive = np.asarray(values, float)
    positive = positive[positive > 0.0]
    low, high = (positive.min() / 1.2, positive.max() * 1.2) if len(positive) else (1.0, 100.0)
    ax.set_yscale("log")
    ax.set_ylim(low, high)
    plain_ticks(ax.yaxis, np.array([low, high]))


def plain_ticks(axis: Axis, ends: np.ndarray) -> None:
    """Ticks of a logarithmic axis between two values: 1, 2 and 5 of each decade, or more or fewer, as there is room."""
    decades = np.log10(ends[1] / ends[0])
    digits = (1, 1.5, 2, 3, 4, 5, 7) if decades < 1.0 else (1, 2, 5) if decades < 3.0 else (1,)
    ticks = [digit * 10.0**e for e in range(-4, 6) for digit in digits]
    axis.set_ticks([tick for tick in ticks if ends[0] <= tick <= ends[1]])
    axis.set_ticks([], minor=True)
    axis.set_major_formatter(lambda value, _: f"{value:g}")
