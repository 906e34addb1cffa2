"""The chapters of the report in their order: each a figure with its explanation, where there is something to see."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from exograv.report.study_figures import deviation, effects, gravity, learning, power, quality, target, windows
from exograv.study.measures.study_data import StudyData
from exograv.study.statistics.findings import StudyFindings


@dataclass(frozen=True)
class Chapter:
    """One figure."""

    name: str
    """Of its files too."""

    title: str
    draw: Callable[[StudyData], Figure | None]
    explain: Callable[[StudyData], str]


CHAPTERS = (
    Chapter("deviation", "Deviation by group", deviation.draw, deviation.explain),
    Chapter("target", "Where the fingers landed", target.draw, target.explain),
    Chapter("windows", "The course of a session", windows.draw, windows.explain),
    Chapter("learning", "From session to session", learning.draw, learning.explain),
    Chapter("gravity", "About the opening of a window", gravity.draw, gravity.explain),
    Chapter("sessions", "Which sessions there are", quality.draw, quality.explain),
)


@dataclass(frozen=True)
class Drawn:
    """A chapter with its figure."""

    name: str
    title: str
    figure: Figure
    text: str


def drawn(data: StudyData, found: StudyFindings | None, planned: dict[str, Any] | None) -> Iterator[Drawn]:
    """All chapters of which there is something to see, effects behind the first, power last; call it in house style."""
    for chapter in CHAPTERS:
        figure = chapter.draw(data)
        if figure is not None:
            yield Drawn(chapter.name, chapter.title, figure, chapter.explain(data))
        if chapter.name == "deviation" and found is not None:
            figure = effects.draw(data, found)
            if figure is not None:
                yield Drawn("effects", "How much the groups differ", figure, effects.explain(found))
    if planned is not None:
        yield Drawn("power", "How many people the next study needs", power.draw(data, planned), power.explain(planned))
