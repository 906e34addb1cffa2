"""Power of a next study over the number of people, and how wide its interval would be."""

from typing import Any

from matplotlib.figure import Figure

from exograv.study.measures.study_data import StudyData

from .groups import WIDTH_2, marked
from .power_curve import power_figure


def draw(data: StudyData, planned: dict[str, Any]) -> Figure:
    """The figure of `exograv study power`, as wide as the others."""
    figure = power_figure(planned)
    figure.set_figwidth(WIDTH_2)
    return marked(figure, data)


def explain(planned: dict[str, Any]) -> str:
    """What one sees, and what follows."""
    return (
        f"For a ratio of {planned['assumptions']['ratio']:.2g}, stated and not taken from this study, with people who "
        f"differ as much as here. {' '.join(planned['sentences'])}"
    )
