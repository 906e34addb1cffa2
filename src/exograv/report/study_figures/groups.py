"""Common elements of a study's figures: widths of journals, one colour and marker per group, the word SIMULATED."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREEN, INK, ORANGE, PINK, SKY
from exograv.report.style.figure_style import mark_simulated, plain_ticks
from exograv.study.measures.study_data import StudyData
from exograv.study.participants.participant_record import SEALED

WIDTH_1, WIDTH_2 = 85.0 / 25.4, 180.0 / 25.4
"""Width of one column and of two columns of a journal [inch]."""


@dataclass(frozen=True)
class GroupStyle:
    """Look of a group: colour, and marker, line and hatching for readers without colour."""

    colour: str
    marker: str
    line: str
    hatch: str


LOOKS = (
    GroupStyle(BLUE, "o", "-", ""),
    GroupStyle(ORANGE, "s", "--", "///"),
    GroupStyle(GREEN, "^", "-.", "..."),
    GroupStyle(PINK, "D", ":", "xxx"),
    GroupStyle(SKY, "v", "-", "\\\\\\"),
)
SEALED_LOOK = GroupStyle(INK, "D", "-", "")


def look(data: StudyData, group: str) -> GroupStyle:
    """Return the look of a group, the same in all figures of a study."""
    return SEALED_LOOK if group == SEALED else LOOKS[data.groups.index(group) % len(LOOKS)]


def label(group: str) -> str:
    """Return the name of a group for a reader."""
    return "all, groups sealed" if group == SEALED else group


def marked(figure: Figure, data: StudyData) -> Figure:
    """Mark a figure of simulated data, so that the mark stays on every copy."""
    if data.is_simulated:
        mark_simulated(figure)
    return figure


def second_axis_mm(ax: Axes, data: StudyData) -> None:
    """Add an axis in millimetres on the right; nothing if screens differ or were not calibrated."""
    pitch = data.pitch_mm
    if pitch is None:
        return
    right = ax.secondary_yaxis(
        "right", functions=(lambda px: pitch * np.asarray(px), lambda mm: np.asarray(mm) / pitch)
    )
    right.set_ylabel("deviation [mm]")
    right.spines["right"].set_visible(True)
    plain_ticks(right.yaxis, np.array(ax.get_ylim()) * pitch)
